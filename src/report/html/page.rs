//! What every page has: head, style and sections.

use crate::report::Edition;
use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = include_str!("style.css");

/// The page around its content, for this `edition`.
pub(super) fn whole(edition: &Edition, title: &str, lead: &Markup, content: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang=(edition.language.code()) {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(STYLE)) }
            }
            body { main { header { (lead) } (content) } }
        }
    };
    edition.of_page(&page.into_string())
}

/// A section that the page calls `id`.
pub(super) fn section(id: &str, title: &str, content: Markup) -> Markup {
    html! { section id=(id) { h2 { (title) } (content) } }
}
