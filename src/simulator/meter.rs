//! Where the flow is measured.

/// Where the flow is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Meter {
    /// Between A and B: the flow of the load, with its sign.
    #[default]
    Load,
    /// In the pressure line: what the supply delivers, to whichever side it goes, with what leaks. All effects show there.
    Supply,
}
