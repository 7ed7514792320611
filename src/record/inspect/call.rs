//! The command line that fits a model to a file.

use crate::record::Mapping;

/// The call that fits a model to the file, to be copied into a shell.
pub(super) fn call(path: &str, mappings: &[Mapping]) -> String {
    let mut call = format!("servobee identify {}", in_shell(path));
    for mapping in mappings {
        call.push_str(&format!(" --map {}", in_shell(&mapping.to_string())));
    }
    call
}

/// `word` in quotes, if a shell needs them.
fn in_shell(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "_-./\\:".contains(c);
    match word.chars().all(plain) && !word.is_empty() {
        true => word.into(),
        false => {
            let mut quoted = String::from("\"");
            for letter in word.chars() {
                if "\"\\$`".contains(letter) {
                    quoted.push('\\');
                }
                quoted.push(letter);
            }
            quoted + "\""
        }
    }
}
