//! Figures: panels, a legend and a caption.

use super::plot::Panel;
use super::role::Role;
use crate::report::Edition;
use maud::{Markup, html};

/// How a mark looks in a legend.
#[derive(Clone, Copy)]
pub(super) enum Key {
    Line,
    Dot,
    Area,
}

/// The legend's lines of the base model and, where something was added to it, of the result.
pub(super) fn before_and_after(changed: bool) -> Vec<(Role, Key, &'static str)> {
    let before = |label| (Role::Before, Key::Line, label);
    match changed {
        true => vec![before("before"), (Role::After, Key::Line, "after")],
        false => vec![before("base model")],
    }
}

/// A line of marks and their names.
pub(super) fn legend(entries: &[(Role, Key, &str)]) -> Markup {
    html! {
        p.legend {
            @for (role, key, name) in entries {
                span {
                    svg viewBox="0 0 36 12" aria-hidden="true" {
                        @match (key, role) {
                            (Key::Line, _) => { polyline fill="none" stroke=(role.hex()) stroke-width=(role.width()) points="1,6 35,6" {} }
                            (Key::Dot, Role::Before | Role::Second) => { polygon fill=(role.hex()) points="18,0 24,11 12,11" {} }
                            (Key::Dot, Role::Rival | Role::Third) => { path stroke=(role.hex()) stroke-width="2" d="M13,1L23,11M13,11L23,1" {} }
                            (Key::Dot, _) => { circle fill=(role.hex()) cx="18" cy="6" r="4" {} }
                            (Key::Area, _) => { rect fill=(role.hex()) x="4" y="1" width="28" height="10" {} }
                        }
                    }
                    " " (name)
                }
            }
        }
    }
}

/// A figure that the page calls `id`: panels, a legend and what is to be seen in them.
/// Its axes are told as this `edition` has them.
pub(super) fn figure(
    id: &str,
    edition: &Edition,
    panels: &[Panel],
    legend: Markup,
    caption: &Markup,
) -> Markup {
    html! {
        figure id=(id) {
            (legend)
            div.panels { @for panel in panels { (panel.draw(edition)) } }
            figcaption { (caption) }
        }
    }
}
