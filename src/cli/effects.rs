//! `servobee effects`.

mod signature;

use super::plot::scatter;
use super::table::{number, table};
use clap::builder::{PossibleValue, PossibleValuesParser};
use comfy_table::{ColumnConstraint, ContentArrangement, Table, presets};
use servobee::model::Output;
use servobee::model::effects::{CATALOGUE, Effect, Entry};
use servobee::report::effects_json;
use servobee::{Error, Result};
use signature::Signature;
use std::io::IsTerminal;

/// Widest line of text.
const WIDTH: u16 = 100;

const NEUTRAL: &str = "\
With these values the model is the one without the effect; any: whatever it is, the others decide.";

/// Lists the effects that a model can lack, or explains one
///
/// With a name: what the effect is, its equation and parameters, when it shows, what it is confused with, and a plot
/// of its signature: the residual that it leaves in a model without it, whose parameters are right. A fit hides a part
/// of that in other parameters.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  servobee effects
  servobee effects hysteresis
  servobee effects sensor_lag.flow")]
pub(super) struct Arguments {
    /// Explain this effect; one that is on an output as NAME or NAME.OUTPUT
    #[arg(value_name = "NAME", value_parser = names(), hide_possible_values = true)]
    name: Option<String>,
    /// Print the list as JSON
    #[arg(long, conflicts_with = "name")]
    json: bool,
}

/// The names of all effects, so that the parser of the call refuses others and suggests the nearest.
fn names() -> PossibleValuesParser {
    let name = |entry: &&'static Entry| {
        let forms = signature::forms(entry);
        PossibleValue::new(entry.name).aliases(forms.iter().map(Effect::to_string))
    };
    PossibleValuesParser::new(CATALOGUE.iter().map(name))
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    match &arguments.name {
        None if arguments.json => {
            tell!("{}", effects_json())
        }
        None => tell!("{}", list()),
        Some(name) => tell!("{}", explain(name)?),
    }
    Ok(())
}

/// Rows of text below heads, wrapped.
fn text(heads: Option<&[&str]>, rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_content_arrangement(ContentArrangement::Dynamic)
        .set_width(WIDTH);
    if let Some(heads) = heads {
        table.add_row(heads.to_vec());
    }
    table.add_rows(rows);
    for column in table.column_iter_mut() {
        column.set_padding((0, 2));
    }
    // What stands first is asked for by its name, which is read and copied whole.
    if let Some(column) = table.column_mut(0) {
        column.set_constraint(ColumnConstraint::ContentWidth);
    }
    table.trim_fmt()
}

fn list() -> String {
    let scale = signature::scale(10.0);
    let row = |entry: &&Entry| {
        let parameters = (entry.parameters)(&scale, None);
        let parameters = parameters.iter().map(|p| match p.unit.as_str() {
            "1" => p.name.clone(),
            unit => format!("{} [{unit}]", p.name),
        });
        vec![
            entry.name.into(),
            entry.port.to_string(),
            entry.summary.into(),
            parameters.collect::<Vec<_>>().join("\n"),
        ]
    };
    let heads = ["effect", "port", "what it is", "parameters"];
    format!(
        "{}\n\n\
         V stands for the unit of the command, or of the output that the effect is on.\n\
         servobee effects NAME explains one and shows its signature, as in: servobee effects hysteresis",
        text(Some(&heads), CATALOGUE.iter().map(row))
    )
}

/// What `name` stands for; on the output where it shows best if `name` leaves that open.
fn chosen(name: &str) -> Result<Effect> {
    let forms = CATALOGUE.iter().flat_map(|entry| signature::forms(entry));
    let mut forms: Vec<Effect> = forms
        .filter(|form| form.to_string() == name || form.entry.name == name)
        .collect();
    // On the flow an effect of the sensor is not one of the command, which the spool would show, too.
    forms.sort_by_key(|form| form.output != Some(Output::Flow));
    forms.first().copied().ok_or_else(|| {
        Error::input(
            "call",
            format!("there is no effect {name:?}"),
            "servobee effects lists them",
        )
    })
}

fn explain(name: &str) -> Result<String> {
    let effect = chosen(name)?;
    let entry = effect.entry;
    let mut rows = vec![
        vec!["port".into(), entry.port.to_string()],
        vec!["equation".into(), entry.equation.into()],
        vec!["shows".into(), entry.shows.into()],
        vec!["confused with".into(), entry.confused.into()],
        vec!["source".into(), entry.source.into()],
    ];
    if entry.outputs.is_some() {
        let forms = signature::forms(entry);
        let forms: Vec<String> = forms.iter().map(Effect::to_string).collect();
        let of = format!("{}; below: {effect}", forms.join(", "));
        rows.insert(1, vec!["on an output".into(), of]);
    }
    let signature = Signature::new(effect)?;
    let absent = signature::absent(effect)?;
    let parameters = absent.iter().map(|(parameter, absent)| {
        vec![
            parameter.name.clone(),
            parameter.unit.clone(),
            absent.map_or("any".into(), number),
        ]
    });
    let values: Vec<String> = signature
        .values
        .iter()
        .filter(|(parameter, _)| !parameter.is_fixed())
        .map(|(parameter, value)| {
            let unit = match parameter.unit.as_str() {
                "1" => String::new(),
                unit => format!(" {unit}"),
            };
            format!("{} = {}{unit}", parameter.name, number(*value))
        })
        .collect();
    let [x, y] = &signature.names;
    let signed = format!(
        "what {} leaves under {} in a model that is right in all else",
        values.join(", "),
        signature.command
    );
    Ok(format!(
        "{}: {}\n\n{}\n\n{}\n\n{}\n\n{}\n\n{}",
        entry.name,
        entry.summary,
        text(None, rows),
        table(&["parameter", "unit", "absent at"], parameters),
        NEUTRAL,
        text(None, [vec!["signature".into(), signed]]),
        scatter(&signature.points, [x, y], std::io::stdout().is_terminal())
    ))
}
