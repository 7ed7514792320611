//! Options that say how records are read.

use servobee::record::{Mapping, Reading, SampleInterval};

#[derive(clap::Args)]
pub(super) struct ReadingOptions {
    /// A column of the files and what it is: "x_cmd_mm=command [mm]"; with a scale and an offset where the file holds
    /// something else: "i=command [%] *12.5 -150"; behind that "below 5" makes it the meter for small values
    #[arg(long, value_name = "COLUMN=CHANNEL [UNIT]")]
    map: Vec<Mapping>,
    /// Time between rows, of files without a column of time: 1e-3 or 1ms
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    sample_interval: Option<SampleInterval>,
    /// Leave out rows in which a column that is taken has an empty cell or a NaN, and say how many
    #[arg(long)]
    skip_incomplete_rows: bool,
}

impl ReadingOptions {
    pub(super) fn reading(&self) -> Reading {
        Reading {
            mappings: self.map.clone(),
            sample_interval: self.sample_interval,
            skip_incomplete_rows: self.skip_incomplete_rows,
        }
    }
}
