//! The language of pages: they are written in English, and a table has what each of their texts is in another.

use crate::{Error, Result};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::str::FromStr;
use std::sync::LazyLock;

/// The words of the pages in German: a file for translators.
const GERMAN: &str = include_str!("german.toml");

/// What may stand before and behind a text that the table has.
const AROUND: [(&str, &str); 8] = [
    (": ", ""),
    ("; ", ""),
    (". ", ""),
    (", ", ""),
    ("", "."),
    ("", ":"),
    ("(", ")"),
    ("", ")"),
];

/// A language of pages.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Language {
    /// In which they are written.
    #[default]
    English,
    /// By the table.
    German,
}

impl FromStr for Language {
    type Err = Error;

    /// `en` or `de`.
    ///
    /// # Errors
    /// Another.
    fn from_str(text: &str) -> Result<Self> {
        match text.trim() {
            "en" => Ok(Self::English),
            "de" => Ok(Self::German),
            _ => Err(Error::input(
                "--language",
                format!("there are no words in {:?}", text.trim()),
                "write en or de",
            )),
        }
    }
}

impl Language {
    /// What HTML calls it.
    pub(in crate::report) fn code(self) -> &'static str {
        match self {
            Self::English => "en",
            Self::German => "de",
        }
    }

    /// An English `text` of a page in this language; one that the table does not have, such as a file's name, stays.
    pub(in crate::report) fn text(self, text: &str) -> String {
        let told = match self {
            Self::English => None,
            Self::German => Reading::of(&WORDS).translated(text),
        };
        told.unwrap_or_else(|| text.into())
    }
}

static WORDS: LazyLock<Words> = LazyLock::new(|| Words::read(GERMAN));

/// A table of words.
struct Words {
    /// Words and signs that are the same in both languages.
    same: BTreeSet<String>,
    /// What stands between two texts.
    joins: Vec<(String, String)>,
    whole: BTreeMap<String, String>,
    /// Texts with places for others, those first that say most.
    patterns: Vec<Pattern>,
}

/// A text with places: what stands between them, and what is in each.
struct Pattern {
    pieces: Vec<String>,
    places: Vec<(Place, String)>,
    /// The same text in the other language.
    told: String,
}

#[derive(Clone, Copy, PartialEq)]
enum Place {
    /// Another text.
    Text,
    /// Numbers with their units.
    Number,
    /// A name, which the table may have.
    Name,
}

/// One text being read: what is known of its parts, which are asked for many times.
struct Reading<'w> {
    words: &'w Words,
    known: RefCell<HashMap<String, Option<String>>>,
}

impl Words {
    /// # Panics
    /// If the table is none: it is part of the program.
    fn read(table: &str) -> Self {
        let table: toml::Table = table.parse().expect("a table of words");
        let text = |value: &toml::Value| value.as_str().expect("a text").to_owned();
        let mut words = Self {
            same: BTreeSet::new(),
            joins: Vec::new(),
            whole: BTreeMap::new(),
            patterns: Vec::new(),
        };
        for (name, part) in &table {
            if let Some(list) = part.as_array() {
                words.same.extend(list.iter().map(text));
                continue;
            }
            for (english, told) in part.as_table().expect("a part of the table") {
                let (english, told) = (english.clone(), text(told));
                if name == "joins" {
                    words.joins.push((english, told));
                } else if english.contains('{') {
                    words.patterns.push(Pattern::new(&english, told));
                } else {
                    words.whole.insert(english, told);
                }
            }
        }
        words.patterns.sort_by_key(|one| usize::MAX - one.said());
        words.joins.sort_by_key(|(join, _)| usize::MAX - rank(join));
        words
    }

    /// Whether `text` is made of numbers, signs, and words that are the same.
    fn is_same(&self, text: &str) -> bool {
        let mut words = text.split(|c: char| !c.is_alphanumeric());
        words.all(|word| {
            // 1.8e-10 is three words.
            let digits = word.strip_suffix('e').unwrap_or(word);
            digits.chars().all(|c| !c.is_alphabetic()) || self.same.contains(word)
        })
    }
}

impl<'w> Reading<'w> {
    fn of(words: &'w Words) -> Self {
        Self {
            words,
            known: RefCell::default(),
        }
    }

    /// `text` in the language of the table, if that has all of it.
    fn translated(&self, text: &str) -> Option<String> {
        if self.words.is_same(text) {
            return Some(text.into());
        }
        if let Some(told) = self.known.borrow().get(text) {
            return told.clone();
        }
        let told = self.read(text);
        self.known.borrow_mut().insert(text.into(), told.clone());
        told
    }

    fn read(&self, text: &str) -> Option<String> {
        self.found(text)
            .or_else(|| {
                // A text may begin a sentence.
                let mut letters = text.chars();
                let first = letters.next().filter(|first| first.is_uppercase())?;
                let small: String = first.to_lowercase().chain(letters).collect();
                self.found(&small).map(|told| capitalised(&told))
            })
            .or_else(|| self.inside(text))
            .or_else(|| self.of_identifier(text))
            .or_else(|| self.joined(text))
    }

    /// What the table itself has.
    fn found(&self, text: &str) -> Option<String> {
        let whole = || self.words.whole.get(text).cloned();
        let mut patterns = self.words.patterns.iter();
        whole().or_else(|| patterns.find_map(|one| one.translated(text, self)))
    }

    /// What stands in brackets, behind a colon or before a full stop.
    fn inside(&self, text: &str) -> Option<String> {
        if let Some((name, unit)) = text
            .strip_suffix(']')
            .and_then(|text| text.split_once(" ["))
        {
            let name = self.translated(name)?;
            let unit = self.translated(unit)?;
            return Some(format!("{name} [{unit}]"));
        }
        AROUND.iter().find_map(|(before, behind)| {
            let inner = text.strip_prefix(before)?.strip_suffix(behind)?;
            let whole = !behind.contains(')')
                || inner.contains('(') == before.is_empty() && !inner.contains('(');
            let told = whole.then(|| self.translated(inner))??;
            Some(format!("{before}{told}{behind}"))
        })
    }

    /// `sensor_lag.flow`.
    fn of_identifier(&self, text: &str) -> Option<String> {
        let is_one = |c: char| c.is_ascii_lowercase() || matches!(c, '_' | '.');
        if !text.chars().all(is_one) {
            return None;
        }
        let spoken = |name: &str| self.translated(&name.replace('_', " "));
        match text.split_once('.') {
            Some((name, channel)) => Some(format!("{} ({})", spoken(name)?, spoken(channel)?)),
            None if text.contains('_') => spoken(text),
            None => None,
        }
    }

    /// Two texts beside each other.
    fn joined(&self, text: &str) -> Option<String> {
        self.words.joins.iter().find_map(|(join, told)| {
            let mut places = text.match_indices(join.as_str());
            // A full stop is part of the sentence before it, which may be several in the table.
            let stop = usize::from(join.starts_with('.'));
            places.find_map(|(at, _)| {
                let first = self.translated(&text[..at + stop])?;
                let second = self.translated(&text[at + join.len()..])?;
                Some(format!("{first}{}{second}", &told[stop..]))
            })
        })
    }
}

/// Sentences part first, then their parts.
fn rank(join: &str) -> usize {
    let order = [" (", " and ", " or ", ", ", ": ", "; ", ". "];
    order
        .iter()
        .position(|own| *own == join)
        .map_or(0, |at| at + 1)
}

impl Pattern {
    fn new(english: &str, told: String) -> Self {
        let mut pieces = Vec::new();
        let mut places = Vec::new();
        let mut rest = english;
        while let Some((before, behind)) = rest.split_once('{') {
            let (name, after) = behind.split_once('}').expect("a place that ends");
            let place = match name.chars().next() {
                Some('#') => Place::Number,
                Some('=') => Place::Name,
                _ => Place::Text,
            };
            pieces.push(before.to_owned());
            places.push((place, format!("{{{name}}}")));
            rest = after;
        }
        pieces.push(rest.to_owned());
        Self {
            pieces,
            places,
            told,
        }
    }

    /// How much of a text it says itself.
    fn said(&self) -> usize {
        self.pieces.iter().map(String::len).sum()
    }

    /// `text` in the other language, if it is this one with something in every place.
    fn translated(&self, text: &str, reading: &Reading) -> Option<String> {
        let rest = text.strip_prefix(self.pieces[0].as_str())?;
        if !text.ends_with(self.pieces[self.places.len()].as_str()) {
            return None;
        }
        self.filled(0, rest, reading, self.told.clone())
    }

    /// `told` with what `rest` has in the places from number `i` on.
    fn filled(&self, i: usize, rest: &str, reading: &Reading, told: String) -> Option<String> {
        let Some((place, name)) = self.places.get(i) else {
            return rest.is_empty().then_some(told);
        };
        let behind = self.pieces[i + 1].as_str();
        let is_last = i + 1 == self.places.len();
        let ends: Vec<usize> = match is_last {
            true => rest
                .strip_suffix(behind)
                .map(str::len)
                .into_iter()
                .collect(),
            false => rest.match_indices(behind).map(|(at, _)| at).collect(),
        };
        ends.into_iter().filter(|&end| end > 0).find_map(|end| {
            let inner = &rest[..end];
            let inner = match place {
                Place::Number => reading.words.is_same(inner).then(|| inner.to_owned()),
                Place::Text => reading.translated(inner),
                Place::Name => reading.translated(inner).or_else(|| Some(inner.to_owned())),
            }?;
            let after = &rest[end + behind.len()..];
            self.filled(i + 1, after, reading, told.replace(name.as_str(), &inner))
        })
    }
}

/// `text` with a capital letter.
fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    first.chain(letters).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::CATALOGUE;

    #[test]
    fn every_effect_has_its_words() {
        for entry in CATALOGUE {
            for text in [entry.cause(), entry.summary, entry.shows] {
                assert_ne!(Language::German.text(text), text, "{}", entry.name);
            }
        }
    }
}
