//! What stands at the four ports of a valve, and what passes between them.

use super::{Input, Real};

/// Pressures at the ports, bar (gauge).
#[derive(Debug, Clone, Copy)]
pub struct Pressures<R> {
    /// Port P.
    pub supply: R,
    /// Port T.
    pub tank: R,
    /// Port A.
    pub a: R,
    /// Port B.
    pub b: R,
}

impl<R: Copy> Pressures<R> {
    /// Those that are measured.
    #[inline(always)]
    pub fn of(input: &Input<R>) -> Self {
        Self {
            supply: input.supply,
            tank: input.tank,
            a: input.a,
            b: input.b,
        }
    }
}

/// Flows through the orifices, L/min, positive in the direction of the name.
#[derive(Debug, Clone, Copy)]
pub struct OrificeFlows<R> {
    /// P to A.
    pub pa: R,
    /// A to T.
    pub at: R,
    /// P to B.
    pub pb: R,
    /// B to T.
    pub bt: R,
    /// P to T through the centre path; zero with four orifices.
    pub pt: R,
}

impl<R: Real> OrificeFlows<R> {
    /// The load flow: the mean of what leaves A and what returns to B.
    #[inline(always)]
    pub fn load(&self) -> R {
        ((self.pa - self.at) + (self.bt - self.pb)) * R::constant(0.5)
    }

    /// What the supply delivers.
    #[inline(always)]
    pub fn supply(&self) -> R {
        self.pa + self.pb + self.pt
    }
}
