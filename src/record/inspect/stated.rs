//! How far rows are apart, where a file says it above its header: `Sample rate: 2000 Hz`, `Abtastzeit;0,5;ms`.

use crate::record::Quantity;

/// What says that a line is about the rows, beside its number.
const OF_ROWS: [&str; 11] = [
    "rate",
    "sampl",
    "abtast",
    "logg",
    "scan",
    "daq",
    "interval",
    "raster",
    "campion",
    "chantillon",
    "muestr",
];

/// The seconds between two rows and the line of those `above` the header that says so; `None` where none does, or two do not agree.
pub(super) fn stated(above: &[String]) -> Option<(f64, &str)> {
    let said = |line: &String| {
        OF_ROWS
            .iter()
            .any(|word| line.to_lowercase().contains(word))
    };
    let mut all = above.iter().filter(|line| said(line));
    let mut all = all
        .by_ref()
        .filter_map(|line| Some((seconds(line)?, line.trim())));
    let first = all.next()?;
    all.all(|(other, _)| (other / first.0 - 1.0).abs() < 1e-6)
        .then_some(first)
}

/// The seconds that a line gives, or one over the Hz.
fn seconds(line: &str) -> Option<f64> {
    let begins = line.find(|letter: char| letter.is_ascii_digit())?;
    let number = |letter: char| letter.is_ascii_digit() || ".,eE-".contains(letter);
    let ends = line[begins..]
        .find(|letter| !number(letter))
        .unwrap_or(line.len() - begins);
    let (value, rest) = line[begins..].split_at(ends);
    let value: f64 = value
        .trim_end_matches([',', '.'])
        .replace(',', ".")
        .parse()
        .ok()?;
    let unit = rest.trim_start_matches(|letter: char| !letter.is_alphanumeric() && letter != 'µ');
    let unit = unit
        .split(|letter: char| !letter.is_alphanumeric() && !"µ/".contains(letter))
        .next()?;
    // Or in brackets before it: `Sample rate [Hz] = 1000`.
    let unit = match unit {
        "" => line[..begins]
            .rsplit_once(['[', '('])?
            .1
            .split([']', ')'])
            .next()?
            .trim(),
        unit => unit,
    };
    let interval = match unit.to_lowercase().as_str() {
        "hz" | "s/s" | "sps" | "1/s" => 1.0 / value,
        "khz" | "ks/s" | "ksps" => 1e-3 / value,
        "" => return None,
        _ => Quantity::Time.unit(Some(unit), "").ok()?.convert(value),
    };
    (interval > 0.0 && interval.is_finite()).then_some(interval)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_above_the_header_says_how_far_rows_are_apart() {
        for (line, interval) in [
            ("Sample rate: 2000 Hz", Some(5e-4)),
            ("Abtastrate = 2000 Hz", Some(5e-4)),
            ("%rate 3125 Hz", Some(3.2e-4)),
            ("acceptance, sample rate [Hz] = 1000", Some(1e-3)),
            ("Rate;1000;Hz", Some(1e-3)),
            ("# logged at 2.5 kHz", Some(4e-4)),
            ("Abtastzeit;0,5;ms", Some(5e-4)),
            ("Sampling interval,250us,", Some(2.5e-4)),
            ("scan rate 1 kS/s", Some(1e-3)),
            ("Fréquence d'échantillonnage : 400 Hz", Some(2.5e-3)),
            ("frecuencia de muestreo: 1 kHz", Some(1e-3)),
            ("Rate;1000", None),
            ("Filter 500 Hz", None),
            ("logger: 14 bit", None),
            ("Sample rate: high", None),
            ("Sample rate: 0 Hz", None),
        ] {
            let lines = ["Bench 2".to_owned(), line.to_owned()];
            let found = stated(&lines);
            let same = found.map(|one| one.0).zip(interval);
            let same = same.map_or(found.is_none() && interval.is_none(), |(found, wanted)| {
                (found / wanted - 1.0).abs() < 1e-12
            });
            assert!(same, "{line}: {found:?}");
        }
        let two = ["rate 1000 Hz", "rate 500 Hz"].map(str::to_owned);
        assert_eq!(stated(&two), None);
        let alike = ["rate 1000 Hz", "sampled every 1 ms"].map(str::to_owned);
        assert_eq!(stated(&alike).map(|one| one.1), Some("rate 1000 Hz"));
    }
}
