//! What a model lets be observed: the list of its outputs, and one value for each of them.

use crate::record::Channel;
use serde::{Deserialize, Serialize};
use std::ops::{Index, IndexMut};

macro_rules! outputs {
    ($($(#[$doc:meta])* $Name:ident => $name:literal),+ $(,)?) => {
        /// A simulated quantity that a measurement is compared with.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum Output {
            $($(#[$doc])* $Name,)+
        }

        impl Output {
            /// All of them, in the order of a record's columns.
            pub const ALL: [Self; Self::COUNT] = [$(Self::$Name),+];
            /// How many there are.
            pub const COUNT: usize = [$($name),+].len();

            /// The name of its channel.
            pub fn name(self) -> &'static str {
                match self { $(Self::$Name => $name,)+ }
            }

            /// Calls `f` with each of them, one after the other and not in a loop: what is indexed by a number that is known when
            /// this is compiled stays in registers.
            #[inline(always)]
            pub fn each(mut f: impl FnMut(Self)) {
                $(f(Self::$Name);)+
            }

            /// The channel of a record that measures it.
            pub fn channel(self) -> Channel {
                match self { $(Self::$Name => Channel::$Name,)+ }
            }
        }
    };
}

outputs! {
    /// Spool position, in the unit of its measurement.
    Spool => "spool",
    /// Flow, L/min.
    Flow => "flow",
    /// Flow from port T while A and B are blocked, L/min.
    ReturnFlow => "return_flow",
    /// Pressure at port A while it is blocked, bar.
    PressureA => "pressure_a",
    /// Pressure at port B while it is blocked, bar.
    PressureB => "pressure_b",
    /// Pressure at port A less that at port B while both are blocked, bar.
    LoadPressure => "load_pressure",
    /// Piston position, mm.
    Position => "position",
}

impl Output {
    /// Whether it is measured while the ports A and B are blocked.
    pub fn is_of_blocked_ports(self) -> bool {
        match self {
            Self::ReturnFlow | Self::PressureA | Self::PressureB | Self::LoadPressure => true,
            Self::Spool | Self::Flow | Self::Position => false,
        }
    }
}

/// One value for each [`Output`].
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Outputs<T>(pub [T; Output::COUNT]);

impl<T> Outputs<T> {
    /// What `f` makes of each output.
    pub fn from_fn(f: impl FnMut(Output) -> T) -> Self {
        Self(Output::ALL.map(f))
    }

    /// Each output and its value.
    pub fn iter(&self) -> impl Iterator<Item = (Output, &T)> {
        Output::ALL.into_iter().zip(&self.0)
    }
}

impl<T: Copy> Outputs<T> {
    /// The same value for each output.
    #[inline(always)]
    pub fn all(value: T) -> Self {
        Self([value; Output::COUNT])
    }
}

impl<T> Index<Output> for Outputs<T> {
    type Output = T;

    #[inline(always)]
    fn index(&self, output: Output) -> &T {
        &self.0[output as usize]
    }
}

impl<T> IndexMut<Output> for Outputs<T> {
    #[inline(always)]
    fn index_mut(&mut self, output: Output) -> &mut T {
        &mut self.0[output as usize]
    }
}
