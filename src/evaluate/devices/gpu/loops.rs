//! How often an invocation goes round its loops, which one driver limits.

use crate::evaluate::problem::{Data, Problem, SAMPLES_PER_PERIOD, Sample, Series, Tone};
use crate::evaluate::simulation::simulate::CHUNK;
use crate::model::exact_step::MOST_PARTS;
use crate::{Error, Result};

/// Mesa's llvmpipe ends every loop of an invocation, without a word, once it has gone round all of them 65 535 times
/// together (`LP_MAX_TGSI_LOOP_ITERATIONS`). Some are left for the search of the command that acts at first.
const MOST: u64 = 60_000;

/// Whether this adapter limits loops.
pub(super) fn limited(info: &wgpu::AdapterInfo) -> bool {
    info.device_type == wgpu::DeviceType::Cpu
}

/// Where an invocation has to end for the sake of its loops.
pub(super) struct Loops {
    /// Rounds at most before each chunk of rows, of any record, and in all; of a tone, as if it were a chunk.
    before: Vec<u64>,
}

impl Loops {
    /// The loops of `problem`. A chunk of rows in which every exact step is cut as often as can be may take more rounds than
    /// there are; it is a dispatch of its own.
    ///
    /// # Errors
    /// If a chunk in which no exact step is cut, or a tone, takes more.
    pub(super) fn of(problem: &Problem) -> Result<Self> {
        let per_chunk = |parts| match &*problem.data {
            Data::Series(all) => of_chunks(problem, all, parts),
            Data::Tones(tones) => vec![tones.iter().map(of_tone).max().unwrap_or(0)],
        };
        if let Some(rounds) = per_chunk(0).into_iter().find(|&rounds| rounds > MOST) {
            return Err(Error::failed(
                format!("loops of {rounds} rounds, of which a GPU in software runs {MOST}"),
                "use --evaluator cpu",
            ));
        }
        let mut before = vec![0];
        for rounds in per_chunk(MOST_PARTS) {
            before.push(before[before.len() - 1] + rounds);
        }
        Ok(Self { before })
    }

    /// The row before which a dispatch that begins at row `begin` has to end.
    pub(super) fn end(&self, begin: u32) -> u32 {
        let first = begin as usize / CHUNK;
        let most = self.before[first] + MOST;
        let chunks = self.before.partition_point(|&rounds| rounds <= most) - 1;
        (chunks.max(first + 1) * CHUNK) as u32
    }
}

fn of_chunks(problem: &Problem, all: &[Series], parts: u32) -> Vec<u64> {
    let longest = all.iter().map(|one| one.samples.len()).max().unwrap_or(0);
    let mut most = vec![0; longest.div_ceil(CHUNK)];
    for one in all {
        for (most, rows) in most.iter_mut().zip(one.samples.chunks(CHUNK)) {
            let rounds = rows.iter().map(|row| of_row(problem, row, parts)).sum();
            *most = u64::max(*most, rounds);
        }
    }
    most
}

/// A loop of `rounds` rounds of `inner` each; what ends it is a round, too.
fn around(rounds: u32, inner: u64) -> u64 {
    u64::from(rounds) * (1 + inner) + 1
}

/// Rounds from one row to the next, as `shaders` has its loops, where every exact step is cut into `parts`.
fn of_row(problem: &Problem, row: &Sample, parts: u32) -> u64 {
    let (_, exact_steps) = problem.parts(row);
    let to_next = match (problem.has_exact_steps(), problem.interpolates()) {
        (true, _) => around(exact_steps, around(parts, 0)),
        (false, true) => around(row.substeps, around(3, 0)),
        (false, false) => around(row.substeps, 0),
    };
    match problem.structure.delays() {
        // The search of the command that acts goes on by a row with each.
        true => 1 + around(1, 0) + around(row.pieces, to_next),
        false => 1 + to_next,
    }
}

fn of_tone(tone: &Tone) -> u64 {
    let samples = around(SAMPLES_PER_PERIOD, around(tone.substeps, 0));
    around(tone.settle + tone.measure, samples)
}
