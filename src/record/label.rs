//! What a column is called.

use super::target::Target;
use super::unit;

/// A name with a unit, as a header has it: `name [unit]`, `name (unit)` or `name/unit`; and `command_V`, where the name is one of ours.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Label {
    /// What the file calls the column: the header's cell, or the path of a variable.
    pub(super) text: String,
    /// Without its unit.
    pub(super) spelt: String,
    /// Lower case, with `_` for blanks and hyphens.
    pub(super) name: String,
    pub(super) unit: Option<String>,
}

impl Label {
    /// What stands in brackets is a unit. What stands in parentheses or behind a slash is one only if it is a known unit:
    /// `spool (filtered)` and `dx/dt` are names.
    pub(super) fn parse(text: &str) -> Self {
        let text = &visible(text.trim());
        let (name, unit) = bracketed(text)
            .or_else(|| parenthesised(text))
            .or_else(|| behind_slash(text))
            .map(|(name, unit)| (name, unit.to_owned()))
            .or_else(|| behind_own_name(text))
            .unwrap_or((text, String::new()));
        Self {
            text: text.into(),
            spelt: name.into(),
            name: normal(name),
            unit: Some(unit).filter(|unit| !unit.is_empty()),
        }
    }

    /// The label of a variable at `path` in a file, which is called `name`, perhaps with its unit.
    pub(super) fn at(path: &str, name: &str) -> Self {
        Self {
            text: path.into(),
            ..Self::parse(name)
        }
    }

    /// How well `wanted` names this column: 2 exactly as in the file, 1 by its name, 0 not at all.
    pub(super) fn called(&self, wanted: &str) -> u8 {
        let last = self.text.rsplit('.').next();
        match wanted {
            _ if self.text == wanted => 2,
            _ if last == Some(wanted) || self.name == normal(wanted) => 1,
            _ => 0,
        }
    }
}

/// `text` without characters that would move a terminal's cursor, or worse.
pub(super) fn visible(text: &str) -> String {
    let shown = |c: char| match c {
        '\t' => ' ',
        c if c.is_control() => char::REPLACEMENT_CHARACTER,
        c => c,
    };
    text.chars().map(shown).collect()
}

/// The unit that a cell of a row of units holds: `s`, `[s]` or `(s)`.
pub(super) fn unit_cell(cell: &str) -> &str {
    let inside = |open, close| cell.strip_prefix(open)?.strip_suffix(close);
    inside('[', ']')
        .or_else(|| inside('(', ')'))
        .unwrap_or(cell)
        .trim()
}

fn normal(name: &str) -> String {
    name.trim().to_lowercase().replace([' ', '-'], "_")
}

fn bracketed(text: &str) -> Option<(&str, &str)> {
    let (name, unit) = text.strip_suffix(']')?.rsplit_once('[')?;
    Some((name.trim(), unit.trim()))
}

fn parenthesised(text: &str) -> Option<(&str, &str)> {
    let (name, unit) = text.strip_suffix(')')?.rsplit_once('(')?;
    let name = name.trim_end().trim_end_matches('/').trim_end();
    is_unit(unit).then_some((name, unit.trim()))
}

/// `flow/L/min` and `flow/(L/min)` have a unit with a slash in it.
fn behind_slash(text: &str) -> Option<(&str, &str)> {
    let (name, unit) = text.split_once('/')?;
    let unit = unit_cell(unit.trim());
    is_unit(unit).then_some((name.trim(), unit))
}

/// `command_V` and `flow_L_per_min` have a unit of what they name.
fn behind_own_name(text: &str) -> Option<(&str, String)> {
    let split = text.match_indices('_');
    let mut split = split.map(|(at, _)| (&text[..at], &text[at + 1..]));
    split.find_map(|(name, unit)| {
        let quantity = Target::named(&normal(name))?.quantity();
        let spelt = [
            unit.into(),
            unit.replace("_per_", "/"),
            unit.replace('_', "/"),
        ];
        let known = |unit: &String| unit != "1" && quantity.unit(Some(unit), "").is_ok();
        Some((name, spelt.into_iter().find(known)?))
    })
}

/// `x(1)` is a column of a matrix, not a pure number.
fn is_unit(text: &str) -> bool {
    text.trim() != "1" && unit::is_known(text.trim())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_stand_in_brackets_in_parentheses_or_behind_a_slash() {
        for (text, name, unit) in [
            ("Spool Position [counts]", "spool_position", Some("counts")),
            ("spool (%)", "spool", Some("%")),
            ("t/s", "t", Some("s")),
            ("flow/L/min", "flow", Some("L/min")),
            ("flow / (L/min)", "flow", Some("L/min")),
            ("spool (filtered)", "spool_(filtered)", None),
            ("dx/dt", "dx/dt", None),
            ("x(1)", "x(1)", None),
            ("x_cmd_mm", "x_cmd_mm", None),
            ("Time_s", "time", Some("s")),
            ("command_V", "command", Some("V")),
            ("supply_pressure_bar", "supply_pressure", Some("bar")),
            ("flow_L_per_min", "flow", Some("L/min")),
            ("flow_l_min", "flow", Some("l/min")),
            ("flow_bar", "flow_bar", None),
            ("spool_1", "spool_1", None),
            ("spool_position", "spool_position", None),
            ("time []", "time", None),
        ] {
            let label = Label::parse(text);
            assert_eq!(
                (label.name.as_str(), label.unit.as_deref()),
                (name, unit),
                "{text}"
            );
        }
    }
}
