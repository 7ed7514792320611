//! The stage of a diagnosis, of which the caller is told and in which it may break off.

use crate::evaluate::Interrupt;
use std::ops::ControlFlow;

/// The stage of a diagnosis.
pub(super) struct Stage<'a> {
    tell: &'a mut dyn FnMut(&str) -> ControlFlow<()>,
    interrupt: &'a Interrupt,
    now: String,
    broken_off: bool,
}

impl<'a> Stage<'a> {
    pub(super) fn new(
        tell: &'a mut dyn FnMut(&str) -> ControlFlow<()>,
        interrupt: &'a Interrupt,
    ) -> Self {
        Self {
            tell,
            interrupt,
            now: "beginning".into(),
            broken_off: false,
        }
    }

    /// The next stage begins. Once it is broken off, nothing begins any more.
    pub(super) fn begins(&mut self, what: &str) {
        if self.goes_on() {
            self.now = what.into();
            self.broken_off = (self.tell)(what).is_break();
        }
    }

    /// Told each generation of a search within the stage.
    pub(super) fn generation(&mut self, number: usize) -> ControlFlow<()> {
        if self.goes_on() {
            let what = format!("{}, generation {number}", self.now);
            self.broken_off = (self.tell)(&what).is_break();
        }
        match self.goes_on() {
            true => ControlFlow::Continue(()),
            false => ControlFlow::Break(()),
        }
    }

    /// Whether it has not been broken off.
    pub(super) fn goes_on(&self) -> bool {
        !self.broken_off && !self.interrupt.asked()
    }

    /// The stage in which it was broken off, if it was.
    pub(super) fn broken_off(&self) -> Option<&str> {
        (!self.goes_on()).then_some(&self.now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_broken_off_begins_nothing_more_and_says_where() {
        let mut heard = Vec::new();
        let mut tell = |what: &str| {
            heard.push(what.to_owned());
            match what {
                "second, generation 2" => ControlFlow::Break(()),
                _ => ControlFlow::Continue(()),
            }
        };
        let never = Interrupt::default();
        let mut stage = Stage::new(&mut tell, &never);
        stage.begins("first");
        assert!(stage.generation(1).is_continue() && stage.goes_on());
        stage.begins("second");
        assert!(stage.generation(1).is_continue() && stage.goes_on());
        assert_eq!(stage.broken_off(), None);
        assert!(stage.generation(2).is_break() && !stage.goes_on());
        stage.begins("third");
        assert!(stage.generation(3).is_break() && !stage.goes_on());
        assert_eq!(stage.broken_off(), Some("second"));
        let all = [
            "first",
            "first, generation 1",
            "second",
            "second, generation 1",
            "second, generation 2",
        ];
        assert_eq!(heard, all);
    }
}
