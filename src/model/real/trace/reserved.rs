//! Names that the languages in which equations are written have for themselves.

use naga::keywords::wgsl;

/// Keywords of C and Modelica that WGSL does not have, and what equations call.
const OTHERS: &[&str] = &[
    "abs",
    "algorithm",
    "and",
    "annotation",
    "block",
    "char",
    "connect",
    "connector",
    "constrainedby",
    "der",
    "discrete",
    "double",
    "each",
    "elseif",
    "elsewhen",
    "encapsulated",
    "end",
    "equation",
    "expandable",
    "flow",
    "float",
    "floor",
    "function",
    "import",
    "impure",
    "in",
    "initial",
    "inner",
    "input",
    "int",
    "long",
    "max",
    "min",
    "model",
    "not",
    "operator",
    "or",
    "outer",
    "output",
    "package",
    "parameter",
    "partial",
    "pure",
    "record",
    "redeclare",
    "replaceable",
    "short",
    "select",
    "signed",
    "sqrt",
    "stream",
    "then",
    "time",
    "unsigned",
    "void",
    "when",
    "within",
];

/// What is wrong with a name that is not writable.
pub(crate) fn not_writable(name: &str) -> String {
    format!(
        "has a parameter or a state {name:?}, which is no name in one of the languages that equations are written in"
    )
}

/// What to do about a name that is none.
pub(crate) const OTHER_NAME: &str = "give it another one, of letters, digits and underscores, that is no keyword of WGSL, C or Modelica";

/// Whether `name` can be that of a parameter or a state in WGSL, C and Modelica.
pub(crate) fn is_writable(name: &str) -> bool {
    let begins = name.starts_with(|first: char| first.is_ascii_alphabetic());
    let goes_on = name
        .chars()
        .all(|one| one.is_ascii_alphanumeric() || one == '_');
    let all = [wgsl::RESERVED, OTHERS];
    begins && goes_on && all.iter().all(|words| !words.contains(&name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_no_keywords_and_have_nothing_but_letters_digits_and_underscores() {
        for name in ["gain", "length", "lag_2", "Kv"] {
            assert!(is_writable(name), "{name}");
        }
        for name in [
            "loop", "var", "double", "equation", "max", "2nd", "_lag", "a b", "größe", "",
        ] {
            assert!(!is_writable(name), "{name}");
        }
    }
}
