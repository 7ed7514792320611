//! Where the flow is measured, and whether the supply is.

/// Where the flow is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Meter {
    /// Between A and B: the flow of the load, with its sign.
    #[default]
    Load,
    /// In the pressure line: what the supply delivers, to whichever side it goes, with what leaks. All effects show there.
    Supply,
}

/// What feeds the valve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Supply {
    /// A pressure drop that does not change, and that nothing records.
    #[default]
    Constant,
    /// A pump whose pressure falls with what is drawn, by 40 % of the drop at the rated flow and with a lag of 50 ms; it is
    /// recorded.
    Measured,
}
