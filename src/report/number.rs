//! Numbers for people.

/// `value` to five significant digits, as short as that allows.
pub fn number(value: f64) -> String {
    rounded(value, 5)
}

/// `value` to so many significant `digits`, as short as that allows.
pub fn rounded(value: f64, digits: i32) -> String {
    let magnitude = value.abs();
    if magnitude == 0.0 {
        return "0".into();
    }
    if !(1e-4..1e7).contains(&magnitude) {
        return format!("{value:.3e}");
    }
    let decimals = (digits - 1 - magnitude.log10().floor() as i32).max(0) as usize;
    let text = format!("{value:.decimals$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').into(),
        false => text,
    }
}

/// `value` to three digits with its unit, in the part of the unit that is easiest to read: `4.69 ms` for 0.00469 s.
pub fn quantity(value: f64, unit: &str) -> String {
    let (factor, unit) = match unit {
        "1" => (1e2, "%".into()),
        "1/s" | "1/K" => (1e2, unit.replacen('1', "%", 1)),
        "s" | "V" | "V/s" | "mm" | "mm/s" if value.abs() < 0.1 && value != 0.0 => {
            let small = match unit.strip_prefix('m') {
                Some(rest) => format!("µ{rest}"),
                None => format!("m{unit}"),
            };
            (1e3, small)
        }
        _ => (1.0, unit.to_owned()),
    };
    let text = rounded(factor * value, 3).replacen('-', "−", 1);
    format!("{text} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_quantities_in_handy_units() {
        let numbers = [0.0, 250.0, 0.0040057, 135.4449, 1e-5, 12_345.6];
        let texts = ["0", "250", "0.0040057", "135.44", "1.000e-5", "12346"];
        assert_eq!(numbers.map(number), texts);
        let quantities = [
            (0.0046921, "s"),
            (0.0000012, "s"),
            (0.06181, "mm"),
            (0.25, "1"),
        ];
        let texts = quantities.map(|(value, unit)| quantity(value, unit));
        assert_eq!(texts, ["4.69 ms", "0.0012 ms", "61.8 µm", "25 %"]);
        assert_eq!(quantity(-0.0031, "V"), "−3.1 mV");
        assert_eq!(quantity(0.002, "1/K"), "0.2 %/K");
        assert_eq!(quantity(15.0, "L/min"), "15 L/min");
    }
}
