//! What is said where a diagnosis gives no name.

use super::number::rounded;
use crate::diagnose::Identified;
use crate::record::joined;

/// What the verdict says that nothing is missing, in one sentence.
pub fn complete(identified: &Identified) -> &'static str {
    match identified.before.structured() {
        false => "The base model lacks nothing that this record shows.",
        true => {
            "The base model follows this record nearly to its noise, and no effect explains the rest."
        }
    }
}

/// What an unexplained verdict says, and why there is none where nothing was diagnosed, in one sentence.
pub fn unexplained(identified: &Identified) -> String {
    if let Some(one) = &identified.undecided {
        return format!(
            "The record cannot tell which of {} the base model lacks.",
            joined(one.causes(), "and")
        );
    }
    let lacks = "The base model lacks something that";
    match asked(identified).as_slice() {
        _ if identified.asked_all() => format!("{lacks} is in no entry of the catalogue."),
        [one] => format!("{lacks} the one effect that was asked, {one}, does not explain."),
        many => format!(
            "{lacks} none of the {} effects that were asked explains.",
            many.len()
        ),
    }
}

/// Why nothing was diagnosed, in one sentence.
pub fn not_diagnosed(identified: &Identified) -> String {
    match (&identified.broken_off, identified.asked.is_empty()) {
        (Some(stage), _) => format!(
            "What the base model lacks was looked for only until the run was interrupted in \"{stage}\"."
        ),
        (None, true) => "Which effects the base model lacks was not asked.".into(),
        (None, false) => {
            "Which effects the base model lacks cannot be told: nothing was held out to judge them by."
                .into()
        }
    }
}

/// Where something is missing, in sentences; nothing where that is not known.
pub fn located(identified: &Identified) -> Option<String> {
    let found = identified.located.as_ref()?;
    Some(format!(
        "What is not named acts {}. Each fitted alone, the spool follows its command to {} times the noise, and the flow the measured spool to {} times.",
        found.place.words(),
        rounded(found.spool, 3),
        rounded(found.path, 3)
    ))
}

/// The names of the effects that were looked for, each once.
pub(super) fn asked(identified: &Identified) -> Vec<&'static str> {
    let mut names: Vec<&str> = Vec::new();
    for effect in &identified.asked {
        if !names.contains(&effect.entry.cause()) {
            names.push(effect.entry.cause());
        }
    }
    names
}
