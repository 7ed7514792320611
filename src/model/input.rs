//! What drives a model: the list of its inputs.

use super::Real;
use crate::record::Channel;
use serde::{Deserialize, Serialize};

macro_rules! inputs {
    ($($(#[$doc:meta])* $name:ident: $Channel:ident),+ $(,)?) => {
        /// What drives a model at one instant. What is not measured is zero.
        #[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
        pub struct Input<T> {
            $($(#[$doc])* pub $name: T,)+
            /// Time since the record's first row, s.
            pub time: T,
        }

        impl<T> Input<T> {
            /// How many numbers it has.
            pub const COUNT: usize = Self::NAMES.len();
            /// The names of its fields, in their order.
            pub const NAMES: [&'static str; [$(stringify!($name)),+].len() + 1] = [$(stringify!($name),)+ "time"];

            /// What `f` makes of the name of each field.
            pub fn from_names(mut f: impl FnMut(&'static str) -> T) -> Self {
                Self { $($name: f(stringify!($name)),)+ time: f("time") }
            }

            /// What `f` makes of the channel of each field, at a `time`.
            pub fn from_channels(mut f: impl FnMut(Channel) -> T, time: T) -> Self {
                Self { $($name: f(Channel::$Channel),)+ time }
            }

            /// The field of `channel`, where it is one.
            pub(crate) fn of_mut(&mut self, channel: Channel) -> Option<&mut T> {
                match channel {
                    $(Channel::$Channel => Some(&mut self.$name),)+
                    _ => None,
                }
            }

            /// Its numbers, in the order of its fields.
            pub fn numbers(self) -> [T; [$(stringify!($name)),+].len() + 1] {
                [$(self.$name,)+ self.time]
            }
        }

        // No closures and no `map` in what follows: they are not always inlined, and only what is inlined is compiled for wide
        // vectors.
        impl<R: Real> Input<R> {
            /// The input whose values are the same for every candidate.
            #[inline(always)]
            pub fn constant(values: &Input<f64>) -> Self {
                Self { $($name: R::constant(values.$name),)+ time: R::constant(values.time) }
            }

            /// The input at a `share` of the way from one to the next.
            #[inline(always)]
            pub fn between(from: &Input<f64>, to: &Input<f64>, share: R) -> Self {
                Self {
                    $($name: R::constant(from.$name) + share * R::constant(to.$name - from.$name),)+
                    time: R::constant(from.time) + share * R::constant(to.time - from.time),
                }
            }
        }
    };
}

inputs! {
    /// The command, in its own unit.
    command: Command,
    /// Pressure at port P, bar (gauge).
    supply: SupplyPressure,
    /// Pressure at port T, bar.
    tank: ReturnPressure,
    /// Pressure at port A, bar.
    a: PressureA,
    /// Pressure at port B, bar.
    b: PressureB,
    /// Temperature of the oil, degC.
    temperature: Temperature,
}
