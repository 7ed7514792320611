//! What marks stand for, and the colour of each: the style sheet gives it its dashes, and its shade in the dark.

use plotters::style::RGBColor;

/// What a mark stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// What was measured.
    Measured,
    /// The base model.
    Before,
    /// The result.
    After,
    /// Another effect in the place of the one that was found.
    Rival,
    /// The noise floor, or what chance allows.
    Noise,
    /// Rows that were not fitted.
    HeldOut,
    /// The spread of measured values.
    Spread,
    /// The first, second and third of three curves of the same sort.
    First,
    Second,
    Third,
    /// Lines to read values by.
    Grid,
    /// Text and axes.
    Text,
}

impl Role {
    /// Its colour on white: those that Okabe and Ito found to be told apart by all, the lighter ones
    /// darkened until they stand out from paper, and greys.
    pub(super) fn colour(self) -> RGBColor {
        match self {
            Self::Measured => RGBColor(0x33, 0x33, 0x33),
            Self::Before => RGBColor(0xD5, 0x5E, 0x00),
            Self::After => RGBColor(0x00, 0x72, 0xB2),
            Self::Rival => RGBColor(0xCC, 0x79, 0xA7),
            Self::Noise => RGBColor(0x00, 0x9E, 0x73),
            Self::HeldOut => RGBColor(0xEF, 0xF3, 0xF7),
            Self::Spread => RGBColor(0xDD, 0xDD, 0xDD),
            Self::First => RGBColor(0x3B, 0x8E, 0xC2),
            Self::Second => RGBColor(0xB5, 0x7B, 0x00),
            Self::Third => RGBColor(0x11, 0x11, 0x11),
            Self::Grid => RGBColor(0xE4, 0xE4, 0xE4),
            Self::Text => RGBColor(0x22, 0x22, 0x22),
        }
    }

    /// The same as text.
    pub(super) fn hex(self) -> String {
        let RGBColor(r, g, b) = self.colour();
        format!("#{r:02X}{g:02X}{b:02X}")
    }

    /// Width of its lines in pixels: what lies above is thinner.
    pub(super) fn width(self) -> f64 {
        match self {
            Self::Measured => 2.5,
            Self::First | Self::Second | Self::Third => 2.0,
            Self::Before | Self::Noise | Self::Rival => 1.6,
            Self::After => 1.4,
            _ => 1.0,
        }
    }
}
