//! What the names of somebody else's columns say: `x_cmd_mm` is a command in mm, `pA` the pressure at port A.

use crate::record::label::Label;
use crate::record::target::Target;
use crate::record::unit;
use crate::record::{Channel, Quantity};

/// How surely a word names a target; a command of the position is a command, the position of a spool a spool.
const NAMES_A_COMMAND: u8 = 9;
const NAMES_THE_SPOOL: u8 = 8;
/// A flow that returns to the tank is no flow through the load.
const NAMES_A_RETURN: u8 = 8;
const NAMES: u8 = 7;
const MEASURED: u8 = 6;
/// A letter that stands for the quantity in formulas, if nothing else is in the name.
const SYMBOL: u8 = 4;
pub(super) const COUNTS: u8 = 2;

/// What a name may mean.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Meaning {
    pub(super) target: Target,
    /// From 1 up.
    pub(super) certainty: u8,
    /// The unit at the end of the name, or beside it.
    pub(super) unit: Option<String>,
    /// What in the name says so.
    pub(super) word: String,
}

/// What the name of a column may mean, in any order.
pub(super) fn meanings(label: &Label) -> Vec<Meaning> {
    let words = words(&label.spelt);
    let targets = [Target::Time]
        .into_iter()
        .chain(Channel::ALL.map(Target::Channel));
    targets
        .filter_map(|target| {
            let imperial = words.iter().any(|word| word.eq_ignore_ascii_case("imp"));
            let known = |unit: &str| {
                // A gallon is another one there.
                let other = imperial && target.quantity() == Quantity::Flow;
                !other && target.quantity().unit(Some(unit), "").is_ok()
            };
            let (stem, unit) = match &label.unit {
                // A column in another unit is another quantity.
                Some(unit) if !known(unit) => return None,
                Some(unit) => (&words[..], Some(unit.clone())),
                None if words
                    .last()
                    .is_some_and(|last| of_a_signal(last) && !known(last)) =>
                {
                    return None;
                }
                None => match without_unit(&words, known) {
                    (stem, None) => (stem, unit_within(&label.spelt, &words, known)),
                    found => found,
                },
            };
            let stem: Vec<String> = stem.iter().map(|word| word.to_lowercase()).collect();
            let (certainty, word) = said(target, &stem)?;
            Some(Meaning {
                target,
                certainty,
                unit,
                word,
            })
        })
        .collect()
}

/// Whether a word is a unit of a signal and nothing else; `A` is a port as well.
fn of_a_signal(word: &str) -> bool {
    let knows = |quantity: Quantity| quantity.unit(Some(word), "").is_ok();
    word != "A"
        && word.parse::<f64>().is_err()
        && knows(Quantity::Signal)
        && !knows(Quantity::Length)
}

/// The pressure before or behind the valve that a column is by its name alone, which says nothing else, and by its unit.
pub(super) fn pressure_at_the_valve(label: &Label) -> Option<Channel> {
    label.unit.as_ref()?;
    let names_it = |channel: &Channel| {
        let target = Target::Channel(*channel);
        let mut all = meanings(label).into_iter();
        let Some(said) = all.find(|one| one.target == target && one.certainty >= NAMES) else {
            return false;
        };
        let words = words(&label.spelt.to_lowercase());
        let mut others = words.iter().filter(|word| **word != said.word);
        others.all(|word| ["p", "pressure", "druck"].contains(&word.as_str()))
    };
    let pressures = [Channel::SupplyPressure, Channel::ReturnPressure];
    pressures.into_iter().find(names_it)
}

/// Whether a name says that a column is no signal of the spool's loop, whatever its unit.
pub(super) fn is_no_signal(label: &Label) -> bool {
    let words: Vec<String> = words(&label.spelt)
        .iter()
        .map(|word| word.to_lowercase())
        .collect();
    let certainty = |channel: Channel| said(Target::Channel(channel), &words).map(|found| found.0);
    let best = Channel::ALL
        .into_iter()
        .max_by_key(|channel| certainty(*channel));
    best.is_some_and(|channel| {
        channel.quantity() != Quantity::Signal && certainty(channel) >= Some(NAMES)
    })
}

/// The unit of this `quantity` that stands beside the name of a column, or that the name ends with: `cycle_ms`.
pub(super) fn unit_of(quantity: Quantity, label: &Label) -> Option<String> {
    let known = |unit: &str| quantity.unit(Some(unit), "").is_ok();
    match &label.unit {
        Some(unit) => Some(unit.clone()).filter(|unit| known(unit)),
        None => without_unit(&words(&label.spelt), known).1,
    }
}

/// The words of a name: `xCmd_mm` has x, Cmd and mm, and `p_kPa` p and kPa.
fn words(name: &str) -> Vec<String> {
    let apart = |letter: char| !(letter.is_alphanumeric() || "%°³²".contains(letter));
    let mut words = Vec::new();
    for piece in name.split(apart).filter(|piece| !piece.is_empty()) {
        // The pressure at port A is no Pa.
        if unit::is_known(piece) && piece != "pA" {
            words.push(piece.to_owned());
            continue;
        }
        let mut before = ' ';
        words.push(String::new());
        for letter in piece.chars() {
            if before.is_lowercase() && letter.is_uppercase() {
                words.push(String::new());
            }
            words.last_mut().expect("there is one").push(letter);
            before = letter;
        }
    }
    words
}

/// The words before a unit that the name ends with: `Q_lpm`, `flow_L_min`.
fn without_unit(words: &[String], known: impl Fn(&str) -> bool) -> (&[String], Option<String>) {
    for length in [2, 1] {
        let Some(before) = words.len().checked_sub(length).filter(|&before| before > 0) else {
            continue;
        };
        let unit = words[before..].join("/");
        if unit.parse::<f64>().is_err() && known(&unit) {
            return (&words[..before], Some(unit));
        }
    }
    (words, None)
}

/// A unit elsewhere in a name: alone in brackets as in `flow (gpm) raw`, or a word of some length as in `flow (gpm at 70 bar)`.
fn unit_within(name: &str, words: &[String], known: impl Fn(&str) -> bool) -> Option<String> {
    let inside = |opened: &str| {
        opened
            .split([')', ']'])
            .next()
            .map(|text| text.trim().to_owned())
    };
    let alone = name.split(['(', '[']).skip(1).filter_map(inside);
    let pairs = words.windows(2).map(|pair| pair.join("/"));
    let long = words.iter().filter(|word| word.chars().count() > 1);
    let mut all = alone.chain(pairs).chain(long.cloned());
    // `x(1)` is a column of a matrix.
    all.find(|unit| unit.parse::<f64>().is_err() && known(unit))
}

/// What says of a quantity that it was measured.
const MEASUREMENT: [&str; 12] = [
    "meas", "measured", "actual", "act", "ist", "istwert", "feedback", "fb", "response", "output",
    "retour", "ritorno",
];

/// Symbols of what no spool is.
const OF_NO_SIGNAL: [&str; 10] = ["q", "qv", "p", "ps", "pt", "pa", "pb", "pl", "f", "t"];

/// What the temperature of no oil is of.
const SURROUNDINGS: [&str; 8] = [
    "amb", "ambient", "ambiante", "ambiente", "room", "air", "aria", "luft",
];

/// How surely the words name the target, and which of them does.
fn said(target: Target, words: &[String]) -> Option<(u8, String)> {
    let (names, symbols): (&[&str], &[&str]) = match target {
        Target::Time => (
            &[
                "time",
                "zeit",
                "timestamp",
                "clock",
                "temps",
                "tempo",
                "tiempo",
            ],
            &["t"],
        ),
        Target::Channel(channel) => match channel {
            Channel::Command => (
                &[
                    "cmd",
                    "command",
                    "commanded",
                    "ref",
                    "reference",
                    "set",
                    "setpoint",
                    "soll",
                    "sollwert",
                    "stellsignal",
                    "stellgröße",
                    "vorgabe",
                    "demand",
                    "desired",
                    "target",
                    "input",
                    "stimulus",
                    "sollstrom",
                    "sollspannung",
                    "consigne",
                    "comando",
                    "consigna",
                ],
                &["u", "w", "r", "u valve", "uv", "u in"],
            ),
            Channel::Spool => (
                &[
                    "spool",
                    "lvdt",
                    "xv",
                    "schieber",
                    "schieberweg",
                    "schieberposition",
                    "schieberstellung",
                    "schieberhub",
                    "ventilschieber",
                    "tiroir",
                    "cursore",
                    "corredera",
                ],
                &["x", "y", "xv"],
            ),
            Channel::Flow => (
                &[
                    "flow",
                    "flowrate",
                    "durchfluss",
                    "durchfluß",
                    "volumenstrom",
                    "débit",
                    "debit",
                    "portata",
                    "caudal",
                ],
                &["q", "qv", "qab", "ql"],
            ),
            Channel::ReturnFlow => (
                &[
                    "return flow",
                    "flow return",
                    "tank flow",
                    "flow t",
                    "leakage",
                    "leak",
                    "leckage",
                    "leckstrom",
                    "lecköl",
                ],
                &["qt", "q return", "q tank"],
            ),
            Channel::SupplyPressure => (
                &[
                    "supply",
                    "sup",
                    "psupply",
                    "pump pressure",
                    "versorgungsdruck",
                    "systemdruck",
                    "speisedruck",
                    "zulaufdruck",
                    "pumpendruck",
                ],
                &["ps", "pp"],
            ),
            Channel::ReturnPressure => (
                &["return", "tank", "ptank", "tankdruck", "rücklaufdruck"],
                &["pt", "pr"],
            ),
            Channel::PressureA => (&[], &["pa", "p1", "pressure a", "pressure 1"]),
            Channel::PressureB => (&[], &["pb", "p2", "pressure b", "pressure 2"]),
            Channel::LoadPressure => (
                &["load pressure", "pressure load", "lastdruck"],
                &["pl", "p load", "papb", "pab"],
            ),
            Channel::Position => (
                &[
                    "position",
                    "pos",
                    "displacement",
                    "cylinder",
                    "zylinder",
                    "piston",
                    "kolben",
                    "kolbenweg",
                    "kolbenposition",
                    "kolbenlage",
                    "zylinderweg",
                    "stroke",
                    "posizione",
                    "posición",
                    "posicion",
                ],
                &["s", "xp"],
            ),
            Channel::Temperature => (
                &[
                    "temperature",
                    "temp",
                    "temperatur",
                    "öltemperatur",
                    "température",
                    "temperatura",
                ],
                &[
                    "t oil", "t oel", "t öl", "t olio", "t huile", "t aceite", "oil", "oel", "öl",
                    "theta", "t",
                ],
            ),
        },
    };
    let of_surroundings = words
        .iter()
        .any(|word| SURROUNDINGS.contains(&word.as_str()));
    if target == Target::Channel(Channel::Temperature) && of_surroundings {
        return None;
    }
    let certainty = match target {
        Target::Channel(Channel::Command) => NAMES_A_COMMAND,
        Target::Channel(Channel::Spool) => NAMES_THE_SPOOL,
        Target::Channel(Channel::ReturnFlow) => NAMES_A_RETURN,
        _ => NAMES,
    };
    let phrase = words.join(" ");
    // Some names are of several words.
    let spaced = format!(" {phrase} ");
    let named = |names: &[&str]| {
        let mut names = names.iter();
        let name = names.find(|name| spaced.contains(&format!(" {name} ")))?;
        Some((*name).to_owned())
    };
    if let Some(word) = named(names) {
        return Some((certainty, word));
    }
    // `QL` is `q_l`, and `Q_ist` is `q`.
    let measured = |word: &&String| !MEASUREMENT.contains(&word.as_str());
    let symbol: String = words.iter().filter(measured).cloned().collect();
    if symbols.iter().any(|own| own.replace(' ', "") == symbol) {
        return Some((SYMBOL, phrase));
    }
    let generic: (u8, &[&str]) = match target {
        Target::Time if words.len() == 1 => (
            COUNTS,
            &[
                "k", "n", "nr", "no", "index", "sample", "samples", "scan", "row", "zeile",
                "counter",
            ],
        ),
        Target::Channel(Channel::Spool) if OF_NO_SIGNAL.contains(&symbol.as_str()) => return None,
        Target::Channel(Channel::Spool) => {
            let places = named(&[
                "position",
                "pos",
                "displacement",
                "stroke",
                "lage",
                "kolbenlage",
                "kolbenweg",
                "kolbenposition",
                "stellung",
                "posizione",
                "posición",
                "posicion",
            ]);
            let found = named(&MEASUREMENT).or(places)?;
            return Some((MEASURED, found));
        }
        _ => return None,
    };
    named(generic.1).map(|word| (generic.0, word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_name_that_says_nothing_else_is_a_pressure_at_the_valve() {
        for (name, expected) in [
            ("supply [bar]", Some(Channel::SupplyPressure)),
            ("p_supply [bar]", Some(Channel::SupplyPressure)),
            ("Pressure supply (psi)", Some(Channel::SupplyPressure)),
            ("Versorgungsdruck [bar]", Some(Channel::SupplyPressure)),
            ("tank [bar]", Some(Channel::ReturnPressure)),
            ("supply", None),
            ("supply [V]", None),
            ("ps [bar]", None),
            ("pilot supply [bar]", None),
            ("supply setpoint [bar]", None),
            ("flow [l/min]", None),
        ] {
            let found = pressure_at_the_valve(&Label::parse(name));
            assert_eq!(found, expected, "{name}");
        }
    }

    #[test]
    fn names_say_what_they_are() {
        for (name, expected) in [
            ("t_s", "time [s]"),
            ("Time", "time [?]"),
            ("k", "time [?]"),
            ("x_cmd_mm", "command [mm]"),
            ("xRef", "command [?]"),
            ("position setpoint (mm)", "command [mm]"),
            ("u_valve", "command [?]"),
            ("x_meas_mm", "spool [mm]"),
            ("spool_position_pct", "spool [pct]"),
            ("x_position", "position [?]"),
            ("Q_lpm", "flow [lpm]"),
            ("flow_L_min", "flow [L/min]"),
            ("Flow (GPM at 1000 psi)", "flow [GPM]"),
            ("Flow (GPM)(1)", "flow [GPM]"),
            ("Cmd (V) filtered", "command [V]"),
            ("Flow (imp GPM)", "flow [?]"),
            ("spool(1)", "spool [?]"),
            ("pA", "pressure_a [?]"),
            ("p_B_bar", "pressure_b [bar]"),
            ("pS", "supply_pressure [?]"),
            ("ps", "supply_pressure [?]"),
            ("p_tank_psi", "return_pressure [psi]"),
            ("return flow (l/min)", "return_flow [l/min]"),
            ("internal_leakage_lpm", "return_flow [lpm]"),
            ("Q_T", "return_flow [?]"),
            ("Q_AB_lpm", "flow [lpm]"),
            ("QL [m3/h]", "flow [m3/h]"),
            ("Q_L", "flow [?]"),
            ("T_Oel/°C", "temperature [°C]"),
            ("pS", "supply_pressure [?]"),
            ("P_sup_bar", "supply_pressure [bar]"),
            ("pump pressure [bar]", "supply_pressure [bar]"),
            ("p_return", "return_pressure [?]"),
            ("load pressure [bar]", "load_pressure [bar]"),
            ("pA-pB", "load_pressure [?]"),
            ("T_oil", "temperature [?]"),
            ("T [°C]", "temperature [°C]"),
            ("Schieberweg [mm]", "spool [mm]"),
            ("Volumenstrom (l/min)", "flow [l/min]"),
            ("Stellgröße [V]", "command [V]"),
            ("Versorgungsdruck [bar]", "supply_pressure [bar]"),
            ("Kolbenweg_mm", "position [mm]"),
            ("Öltemperatur [°C]", "temperature [°C]"),
            // No piston's position is in the unit of a signal.
            ("position (mA)", "spool [mA]"),
            ("Kolbenlage [%]", "spool [%]"),
            ("Kolbenlage [mm]", "position [mm]"),
            ("Lage (V)", "spool [V]"),
            ("Scan", "time [?]"),
            ("u_cmd_mV", "command [mV]"),
            ("supply_kPa", "supply_pressure [kPa]"),
            ("pTank_MPa", "return_pressure [MPa]"),
            ("Q_ist", "flow [?]"),
            ("ps_ist", "supply_pressure [?]"),
            ("x_ist", "spool [?]"),
            ("Kolbenweg_V", "spool [V]"),
            ("Température (°C)", "temperature [°C]"),
            ("Ambient temperature [°C]", ""),
            ("force_N", ""),
            ("p_pressure", ""),
        ] {
            let best = meanings(&Label::parse(name))
                .into_iter()
                .max_by_key(|m| m.certainty);
            let best = best.map_or(String::new(), |m| {
                format!("{} [{}]", m.target, m.unit.as_deref().unwrap_or("?"))
            });
            assert_eq!(best, expected, "{name}");
        }
    }
}
