//! What a user should know of a run that goes on all the same.

/// Warnings, each kept once.
#[derive(Debug, Default)]
pub(in crate::evaluate) struct Warnings {
    all: Vec<String>,
    taken: usize,
}

impl Warnings {
    /// Adds a warning, unless it was there before.
    pub(in crate::evaluate) fn add(&mut self, text: String) {
        if !self.all.contains(&text) {
            self.all.push(text);
        }
    }

    /// The warnings that were added since this was called last.
    pub(in crate::evaluate) fn take(&mut self) -> Vec<String> {
        let new = self.all[self.taken..].to_vec();
        self.taken = self.all.len();
        new
    }
}
