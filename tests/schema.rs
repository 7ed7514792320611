//! The schemas of what programs read: every document that the tests look at is valid, and what is not is refused.

use crate::program::{bench, json, printed, servobee};
use serde_json::{Value, json as document};
use std::fs::read_to_string;
use std::path::Path;

/// The schema of the document that says it is of `kind`.
fn schema(kind: &str) -> Value {
    let path =
        Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("src/report/schema/{kind}.schema.json"));
    serde_json::from_str(&read_to_string(path).unwrap()).unwrap()
}

/// Whether a document is as its schema has it, or where it is not.
fn validated(document: &Value) -> Result<(), String> {
    let name = document["schema"].as_str().ok_or("it has no schema")?;
    let kind = name.split('/').nth(1).ok_or("its schema has no kind")?;
    let schema = schema(kind);
    let mut errors = Vec::new();
    check(&schema, &schema, document, kind, &mut errors);
    match errors.is_empty() {
        true => Ok(()),
        false => Err(errors.join("\n")),
    }
}

/// Checks `value`, which stands at `place`, against `schema`, a part of `root`. It knows the words of JSON schema that ours use,
/// and no other: a validator for all of them takes thirty crates.
fn check(root: &Value, schema: &Value, value: &Value, place: &str, errors: &mut Vec<String>) {
    for (word, rule) in schema.as_object().expect("a schema is an object") {
        let right = match word.as_str() {
            "$schema" | "$defs" | "title" | "description" | "required" => true,
            "$ref" => {
                let name = rule.as_str().unwrap().strip_prefix("#/$defs/").unwrap();
                let part = root["$defs"].get(name);
                check(
                    root,
                    part.expect("what is referred to"),
                    value,
                    place,
                    errors,
                );
                true
            }
            "type" => match rule {
                Value::String(name) => is_of(value, name),
                names => names
                    .as_array()
                    .unwrap()
                    .iter()
                    .any(|name| is_of(value, name.as_str().unwrap())),
            },
            "const" => value == rule,
            "enum" => rule.as_array().unwrap().contains(value),
            "pattern" => is_time(value.as_str().unwrap_or_default()),
            "minimum" => value
                .as_f64()
                .is_none_or(|number| number >= rule.as_f64().unwrap()),
            "maximum" => value
                .as_f64()
                .is_none_or(|number| number <= rule.as_f64().unwrap()),
            "minItems" => value
                .as_array()
                .is_none_or(|list| list.len() as u64 >= rule.as_u64().unwrap()),
            "maxItems" => value
                .as_array()
                .is_none_or(|list| list.len() as u64 <= rule.as_u64().unwrap()),
            "items" => {
                for (i, item) in value.as_array().into_iter().flatten().enumerate() {
                    check(root, rule, item, &format!("{place}/{i}"), errors);
                }
                true
            }
            "oneOf" => {
                let fits = |part: &&Value| {
                    let mut wrong = Vec::new();
                    check(root, part, value, place, &mut wrong);
                    wrong.is_empty()
                };
                rule.as_array().unwrap().iter().filter(fits).count() == 1
            }
            "properties" => {
                let needed = schema["required"].as_array().unwrap();
                for (name, part) in rule.as_object().unwrap() {
                    match value.get(name) {
                        Some(own) => check(root, part, own, &format!("{place}/{name}"), errors),
                        None if needed.iter().any(|one| one == name) => {
                            errors.push(format!("{place} has no {name}"));
                        }
                        None => {}
                    }
                }
                true
            }
            "additionalProperties" => {
                let known = |name: &str| schema["properties"].get(name).is_some();
                for (name, own) in value.as_object().into_iter().flatten() {
                    let place = format!("{place}/{name}");
                    match rule {
                        Value::Bool(false) if !known(name) => {
                            errors.push(format!("{place} is unknown"))
                        }
                        Value::Object(_) if !known(name) => check(root, rule, own, &place, errors),
                        _ => {}
                    }
                }
                true
            }
            other => panic!("{other:?} is no word that is known here"),
        };
        if !right {
            errors.push(format!("{place}: {value} is not {word} {rule}"));
        }
    }
}

fn is_of(value: &Value, name: &str) -> bool {
    match name {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "number" => value.is_number(),
        "integer" => value.is_u64() || value.is_i64(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        other => panic!("{other:?} is no type"),
    }
}

/// The one pattern that there is: `2026-01-31T23:59:59Z`.
fn is_time(text: &str) -> bool {
    let like = "0000-00-00T00:00:00Z";
    let same = |(own, like): (char, char)| match like {
        '0' => own.is_ascii_digit(),
        other => own == other,
    };
    text.len() == like.len() && text.chars().zip(like.chars()).all(same)
}

/// Asserts that a document that was written is as its schema has it.
pub(crate) fn assert_valid(document: &Value) {
    if let Err(errors) = validated(document) {
        panic!("{errors}");
    }
}

#[test]
fn a_report_is_as_its_schema_has_it_and_one_that_is_not_is_seen() {
    let folder = bench();
    let call = [
        "identify",
        "bench.csv",
        "--effects",
        "delay",
        "--evaluator",
        "cpu",
        "--out",
        "out",
    ];
    printed(&servobee(folder.path(), &call));
    let report = json(folder.path().join("out/report.json"));
    for (pointer, wrong) in [
        ("/verdict", document!("perhaps")),
        ("/parameters/0/value", document!("250")),
        ("/card/0", document!({})),
        ("/schema", document!("servobee/report/0")),
        ("/date", document!("today")),
        ("/limits", document!(null)),
        ("/effects/0/error_before", document!("1")),
    ] {
        let mut other = report.clone();
        *other.pointer_mut(pointer).unwrap() = wrong;
        assert!(validated(&other).is_err(), "{pointer}");
    }
    for key in report.as_object().unwrap().keys() {
        let mut other = report.clone();
        other.as_object_mut().unwrap().remove(key);
        assert!(validated(&other).is_err(), "without {key}");
    }
    let mut other = report.clone();
    other["unknown"] = document!(1);
    assert!(validated(&other).is_err());
}

#[test]
fn the_report_of_a_datasheet_is_as_the_schema_has_it() {
    let folder = tempfile::tempdir().unwrap();
    let call = [
        "datasheet",
        "--case",
        "step",
        "--evaluator",
        "cpu",
        "--json",
    ];
    let report: Value = serde_json::from_str(&printed(&servobee(folder.path(), &call))).unwrap();
    assert_valid(&report);
}
