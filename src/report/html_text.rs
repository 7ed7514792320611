//! What a page says, apart from its marks.

/// Elements whose content is no text for readers.
const CODE: [&str; 2] = ["style", "code"];

/// The `page` with `tell` done to every text of it, and to the labels of its plots: not to what is marked `translate="no"`,
/// which is a name.
pub(super) fn map(page: &str, tell: impl Fn(&str) -> String) -> String {
    let mut told = String::with_capacity(page.len());
    let mut open: Vec<bool> = Vec::new();
    let mut rest = page;
    while let Some(start) = rest.find('<') {
        let (text, tag) = rest.split_at(start);
        let is_name = open.last().is_some_and(|&own| own);
        told += &match is_name || !text.contains(char::is_alphabetic) {
            true => text.to_owned(),
            false => of_text(text, &tell),
        };
        let end = tag.find('>').map_or(tag.len(), |end| end + 1);
        let (tag, behind) = tag.split_at(end);
        told += &of_tag(tag, is_name, &tell);
        if tag.starts_with("</") {
            open.pop();
        } else if !is_void(tag) {
            let name = name(tag);
            open.push(is_name || CODE.contains(&name) || tag.contains(" translate=\"no\""));
        }
        rest = behind;
    }
    told + rest
}

/// A text between tags, whose blanks at both ends stay.
fn of_text(text: &str, tell: &impl Fn(&str) -> String) -> String {
    let inner = text.trim();
    let at = text.len() - text.trim_start().len();
    let (head, tail) = (&text[..at], &text[at + inner.len()..]);
    format!("{head}{}{tail}", escaped(&tell(&plain(inner))))
}

/// A tag, whose label is text as well.
fn of_tag(tag: &str, is_name: bool, tell: &impl Fn(&str) -> String) -> String {
    const LABEL: &str = "aria-label=\"";
    let label = tag.find(LABEL).map(|at| at + LABEL.len());
    let found = label.filter(|_| !is_name).and_then(|from| {
        let length = tag[from..].find('"')?;
        Some((from, from + length))
    });
    match found {
        Some((from, to)) => {
            let label = escaped(&tell(&plain(&tag[from..to])));
            format!("{}{label}{}", &tag[..from], &tag[to..])
        }
        None => tag.into(),
    }
}

/// Whether nothing closes this tag.
fn is_void(tag: &str) -> bool {
    tag.ends_with("/>") || ["meta", "br", "!DOCTYPE"].contains(&name(tag))
}

fn name(tag: &str) -> &str {
    let name = tag.trim_start_matches('<');
    let end = name.find(|c: char| c.is_whitespace() || matches!(c, '>' | '/'));
    &name[..end.unwrap_or(name.len())]
}

fn plain(text: &str) -> String {
    let text = text.replace("&lt;", "<").replace("&gt;", ">");
    let text = text.replace("&quot;", "\"").replace("&apos;", "'");
    text.replace("&amp;", "&")
}

fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    text.replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_and_labels_are_told_and_names_stay() {
        let page = "<!DOCTYPE html><style>p { a }</style><p>a &lt; b<br> \n c</p><svg aria-label=\"d &amp; e\"><line/></svg>\
                    <p translate=\"no\">f<b>g</b></p><p>h <code>i</code> 7</p>";
        let told = map(page, str::to_uppercase);
        let expected = "<!DOCTYPE html><style>p { a }</style><p>A &lt; B<br> \n C</p><svg aria-label=\"D &amp; E\"><line/></svg>\
                    <p translate=\"no\">f<b>g</b></p><p>H <code>i</code> 7</p>";
        assert_eq!(told, expected);
        assert_eq!(map(page, str::to_owned), page);
    }
}
