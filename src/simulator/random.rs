//! Random numbers.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// What the random numbers of one seed are for: each purpose has its own, so that one does not shift another.
#[derive(Debug, Clone, Copy)]
pub(super) enum Stream {
    Valve,
    Command,
    Sensors,
    Hanging,
    Noise,
    Hum,
}

pub(super) fn random(seed: u64, stream: Stream) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream as u64);
    rng
}
