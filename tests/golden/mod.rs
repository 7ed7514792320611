//! Reads the reference solutions beside this file.

use std::path::Path;

/// A reference solution, or some rows of one: comment lines with `key=value` pairs, and a table.
#[derive(Clone)]
pub(crate) struct Golden {
    comments: Vec<String>,
    header: Vec<String>,
    table: Vec<Vec<String>>,
}

impl Golden {
    /// The file `name`.csv.
    pub(crate) fn read(name: &str) -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
        let text = std::fs::read_to_string(folder.join(format!("{name}.csv")));
        let text = text.unwrap_or_else(|error| panic!("{name}.csv: {error}"));
        let (comments, table): (Vec<&str>, _) =
            text.lines().partition(|line| line.starts_with('#'));
        let cells = |line: &str| line.split(',').map(str::to_owned).collect();
        let mut table: Vec<Vec<String>> = table.into_iter().map(cells).collect();
        Self {
            comments: comments.into_iter().map(str::to_owned).collect(),
            header: table.remove(0),
            table,
        }
    }

    /// The value of `key`: the cell of a single row, or what the comments say.
    pub(crate) fn word(&self, key: &str) -> &str {
        if let ([row], Some(index)) = (&self.table[..], self.index(key)) {
            return &row[index];
        }
        let words = self
            .comments
            .iter()
            .flat_map(|line| line.split_whitespace());
        let mut found = words.filter_map(|word| word.strip_prefix(key)?.strip_prefix('='));
        found.next().unwrap_or_else(|| panic!("no value {key}"))
    }

    /// The same as a number.
    pub(crate) fn number(&self, key: &str) -> f64 {
        let word = self.word(key);
        word.parse().unwrap_or_else(|_| panic!("{key} is {word}"))
    }

    fn index(&self, column: &str) -> Option<usize> {
        self.header.iter().position(|name| name == column)
    }

    /// All numbers of a column.
    pub(crate) fn column(&self, name: &str) -> Vec<f64> {
        let index = self
            .index(name)
            .unwrap_or_else(|| panic!("no column {name}"));
        let number = |row: &Vec<String>| row[index].parse().expect("a number");
        self.table.iter().map(number).collect()
    }

    /// Its rows, one by one.
    pub(crate) fn rows(&self) -> impl Iterator<Item = Self> {
        self.table.iter().map(|row| self.with(vec![row.clone()]))
    }

    /// The rows with `value` in `column`.
    pub(crate) fn rows_where(&self, column: &str, value: &str) -> Self {
        let index = self
            .index(column)
            .unwrap_or_else(|| panic!("no column {column}"));
        let matching = self.table.iter().filter(|row| row[index] == value);
        self.with(matching.cloned().collect())
    }

    /// The comment lines `case=NUMBER ...`: the numbers, and the values in each.
    pub(crate) fn cases(&self) -> Vec<(String, Self)> {
        let lines = self
            .comments
            .iter()
            .filter(|line| line.starts_with("# case="));
        let one = |line: &String| {
            let case = Self {
                comments: vec![line.clone()],
                header: vec![],
                table: vec![],
            };
            (case.word("case").to_owned(), case)
        };
        lines.map(one).collect()
    }

    fn with(&self, table: Vec<Vec<String>>) -> Self {
        Self {
            table,
            ..self.clone()
        }
    }
}
