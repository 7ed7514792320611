//! The words for what held-out rows had to set.

use super::number::number;
use crate::diagnose::{Sharpened, Unexcited};

/// A warning of a parameter that the fitted rows leave open.
pub(super) fn unexcited(found: &Unexcited) -> String {
    let (parameter, unit) = (&found.parameter, &found.unit);
    let [low, high, value] = [found.low, found.high, found.value].map(number);
    let asked = match found.rows {
        0 => "No held-out row alone depends on it, all together do".to_string(),
        rows => {
            let (from, to) = found.time;
            format!(
                "{rows} held-out rows depend on it (in {} from {from:.3} to {to:.3} s)",
                found.record
            )
        }
    };
    format!(
        "the fitted rows do not determine {parameter}: between {low} and {high} {unit} it makes no difference to them. {asked}: it \
         was set to {value} {unit} by these, for the base model and every rival alike. Fit rows that excite it as well"
    )
}

/// A warning of parameters that the fitted rows leave open within their intervals.
pub(super) fn sharpened(found: &Sharpened) -> String {
    let (parameter, unit) = (&found.parameter, &found.unit);
    let [from, to] = [found.from, found.to].map(number);
    format!(
        "the held-out rows ask for the parameters more closely than the fitted rows determine them: all were moved within what the \
         fitted rows allow, for the base model and every rival alike, and most of all {parameter}, from {from} to {to} {unit}. Fit \
         rows that determine them as well"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::edition::Language;

    #[test]
    fn what_was_set_is_said_in_every_language() {
        let mut open = Unexcited {
            parameter: "stiction".into(),
            unit: "V".into(),
            low: 0.0,
            high: 0.029,
            value: 1.25e-5,
            rows: 0,
            record: String::new(),
            time: (0.0, 0.0),
        };
        let together = unexcited(&open);
        (open.rows, open.record, open.time) = (3, "bench".into(), (1.0, 2.0));
        let moved = Sharpened {
            parameter: "time_constant".into(),
            unit: "s".into(),
            from: 0.00432,
            to: 0.00447,
        };
        let german = Language::German;
        for (said, words, translated) in [
            (
                together,
                "No held-out row alone depends on it, all together do: it was set to 1.250e-5 V",
                "es wurde durch sie auf 1.250e-5 V gesetzt",
            ),
            (
                unexcited(&open),
                "3 held-out rows depend on it (in bench from 1.000 to 2.000 s): it was set",
                "3 zurückgehaltene Zeilen hängen davon ab (in bench von 1.000 bis 2.000 s)",
            ),
            (
                sharpened(&moved),
                "most of all time_constant, from 0.00432 to 0.00447 s.",
                "am meisten Zeitkonstante, von 0.00432 nach 0.00447 s.",
            ),
        ] {
            assert!(said.contains(words), "{said}");
            let told = german.text(&said);
            assert!(told.contains(translated), "{told}");
        }
        let alike = "for the base model and every rival alike, and a warning says";
        assert!(include_str!("../../README.md").contains(alike));
    }
}
