//! The command line that fits a model to a file.

use crate::record::Reading;

/// The call that fits a model to the file, to be copied into a shell.
pub(super) fn call(path: &str, reading: &Reading) -> String {
    let mut call = format!("servobee identify {}", in_shell(path));
    for mapping in &reading.mappings {
        call.push_str(&format!(" --map {}", in_shell(&mapping.to_string())));
    }
    if let Some(interval) = reading.sample_interval {
        call.push_str(&format!(" --sample-interval {}", interval.seconds()));
    }
    if reading.skip_incomplete_rows {
        call.push_str(" --skip-incomplete-rows");
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
