//! The model in equations, and what each of its parameters means.

use crate::model::Structure;
use crate::report::{ParameterReport, explain};
use maud::{Markup, html};

/// The equations of the base model and of every effect of `structure`, and its `parameters` in words.
pub(super) fn of(structure: &Structure, parameters: &[ParameterReport]) -> Markup {
    let scale = structure.generic_scale();
    let effects = &structure.effects;
    let of_effect = |name: &str| {
        let owns = |effect: &&crate::model::effects::Effect| {
            effect.parameters(&scale).iter().any(|own| own.name == name)
        };
        effects.iter().find(owns)
    };
    html! {
        ul {
            @for equation in explain::base_equations(structure) { li { span { (equation) "." } } }
            @for effect in effects {
                li { span { (effect.entry.equation) } ": " (effect.to_string().replace('_', " ")) ". " (effect.entry.summary) "." }
            }
        }
        div.scroll { table {
            thead { tr { th { "parameter" } th { "unit" } th { "what it means" } } }
            tbody { @for parameter in parameters { tr {
                td translate="no" { (parameter.name) } td { (parameter.unit) }
                td.wrap {
                    @if let Some(meaning) = explain::meaning(&parameter.name) { (meaning) }
                    @else if let Some(effect) = of_effect(&parameter.name) { "of the effect " (effect.to_string().replace('_', " ")) }
                }
            } } }
        } }
    }
}
