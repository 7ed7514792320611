//! Options that several commands share.

use super::{interrupt, ranks};
use indicatif::{ProgressBar, ProgressStyle};
use servobee::Result;
use servobee::evaluate::{Chosen, Devices};
use servobee::report::{Edition, Language, OutputFolder, Units};
use std::ops::ControlFlow;
use std::path::PathBuf;

/// Options of every long run.
#[derive(clap::Args)]
pub(super) struct RunOptions {
    /// What evaluates the candidates: auto takes the CPU, and a hardware GPU, where there is one, for large populations; gpu a
    /// GPU for all, also one in software, gpu:1 the one that `servobee devices` calls so; several share every population: gpu:0+gpu:1, cpu+gpu,
    /// gpu:all
    #[arg(long, value_name = "auto|cpu|gpu|...", default_value_t)]
    evaluator: Devices,
    /// Seed of the search and of intervals; the same seed gives the same result
    #[arg(long, default_value_t = 1)]
    pub(super) seed: u64,
    /// Command at full scale, in its unit [default: 10 for V, 100 for %, otherwise the largest command]
    #[arg(long, value_name = "NUMBER", value_parser = bare_number)]
    pub(super) full_scale: Option<f64>,
    /// Overwrite the results in a folder that exists
    #[arg(long)]
    pub(super) force: bool,
    /// Go on with a run that was cut off; the result is the same
    #[arg(long)]
    pub(super) resume: bool,
    /// Units of flow, pressure and length on pages and on the terminal: us (gpm, psi, in), metric (L/min, bar, mm), or some
    /// by name: "gpm, MPa"; report.json and every CSV keep theirs
    #[arg(long, value_name = "us|metric|UNIT,...", default_value = "metric")]
    units: Units,
    /// Language of the pages: English or German
    #[arg(long, value_name = "en|de", default_value = "en")]
    language: Language,
    /// Print nothing but warnings and errors, and what --json asks for
    #[arg(long, short)]
    pub(super) quiet: bool,
}

/// A number; with a unit behind it the remedy is to leave that out.
fn bare_number(text: &str) -> std::result::Result<f64, String> {
    let unit = |c: char| c.is_alphabetic() || c == '%' || c.is_whitespace();
    let bare = text.trim_end_matches(unit);
    text.parse().map_err(|error| match bare.parse::<f64>() {
        Ok(_) => format!("give the number alone, in the unit of the record's command: {bare}"),
        Err(_) => format!("{error}"),
    })
}

impl RunOptions {
    /// The evaluator.
    pub(super) fn evaluator(&self) -> Result<Chosen> {
        ranks::choose(&self.evaluator)
    }

    /// How people are told the result.
    pub(super) fn edition(&self) -> Edition {
        Edition {
            units: self.units,
            language: self.language,
        }
    }
}

/// Options of a run with one result.
#[derive(clap::Args)]
pub(super) struct Options {
    #[command(flatten)]
    pub(super) run: RunOptions,
    /// Folder for the results, which is made
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// File in which the run keeps what it has computed until it ends [default: beside --out, DIR.checkpoint]
    #[arg(long, value_name = "FILE")]
    pub(super) checkpoint: Option<PathBuf>,
    /// Print the report as JSON, and nothing else on standard output
    #[arg(long)]
    pub(super) json: bool,
}

/// Options that say where the result goes and how it is told, and whether a value follows.
const ASIDE: [(&str, bool); 10] = [
    ("--out", true),
    ("--task", true),
    ("--checkpoint", true),
    ("--units", true),
    ("--language", true),
    ("--force", false),
    ("--resume", false),
    ("--json", false),
    ("--quiet", false),
    ("-q", false),
];

/// The arguments of the program as they were given, but for those that the result does not depend on.
pub(super) fn arguments() -> Vec<String> {
    let given = std::env::args_os().skip(1);
    that_matter(given.map(|argument| argument.to_string_lossy().into_owned()))
}

fn that_matter(given: impl IntoIterator<Item = String>) -> Vec<String> {
    let mut given = given.into_iter();
    let mut kept = Vec::new();
    while let Some(argument) = given.next() {
        let aside = |&&(name, valued): &&(&str, bool)| {
            let rest = argument.strip_prefix(name);
            rest.is_some_and(|rest| rest.is_empty() || valued && rest.starts_with('='))
        };
        match ASIDE.iter().find(aside) {
            None => kept.push(argument),
            Some((name, true)) if argument == *name => {
                given.next();
            }
            Some(_) => {}
        }
    }
    kept
}

impl Options {
    /// Whether results are told in words.
    pub(super) fn talks(&self) -> bool {
        !self.json && !self.run.quiet
    }

    /// Prints the `report`, which is JSON, where that is asked for; makes and writes the `files` where there is a folder for them, and says
    /// where they are.
    pub(super) fn hand_over(
        &self,
        report: &str,
        output: Option<OutputFolder>,
        files: impl FnOnce() -> Vec<(String, String)>,
    ) -> Result<()> {
        if self.json {
            super::out::write(format_args!("{report}"));
        }
        let Some(output) = output else { return Ok(()) };
        let files = files();
        output.write(&files)?;
        if self.talks() {
            let names: Vec<&str> = files.iter().map(|file| file.0.as_str()).collect();
            let folder = output.path().display();
            tell!("\nWritten to {folder}: {}", names.join(", "));
        }
        Ok(())
    }

    /// The folder of results, checked before anything long begins.
    pub(super) fn output(&self) -> Result<Option<OutputFolder>> {
        self.out
            .as_deref()
            .map(|path| {
                // A run that is gone on with may have written what it knew when it was interrupted.
                let own =
                    self.run.resume && self.checkpoint_path().is_some_and(|path| path.exists());
                OutputFolder::reserve(path, self.run.force || own)
            })
            .transpose()
    }

    /// The evaluator, named to the user with the reason for it.
    pub(super) fn evaluator(&self) -> Result<Chosen> {
        let chosen = self.run.evaluator()?;
        if self.talks() {
            tell!(
                "Evaluator: {} ({})",
                chosen.evaluator.describe(),
                chosen.why
            );
        }
        Ok(chosen)
    }
}

/// A bar on a terminal, nothing in a pipe.
pub(super) fn progress(
    what: &str,
    generations: usize,
) -> (ProgressBar, impl FnMut(usize) -> ControlFlow<()> + use<>) {
    let style =
        ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} generations, {eta} left");
    let bar = ProgressBar::new(generations as u64).with_style(style.expect("a valid template"));
    bar.set_message(what.to_owned());
    let tick = bar.clone();
    let progress = move |generation| {
        tick.set_position(generation as u64);
        interrupt::goes_on()
    };
    (bar, progress)
}

/// A line that says what is being done, on a terminal; nothing in a pipe.
pub(super) fn spinner() -> ProgressBar {
    let style =
        ProgressStyle::with_template("{spinner} {elapsed} {msg}").expect("a valid template");
    let bar = ProgressBar::new_spinner().with_style(style);
    bar.enable_steady_tick(std::time::Duration::from_millis(100));
    bar
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn where_the_result_goes_is_no_part_of_what_was_asked() {
        let kept = |call: &str| that_matter(call.split(' ').map(String::from)).join(" ");
        assert_eq!(
            kept(
                "identify a.csv --out x --seed 3 --units us --language=de --checkpoint=y --map --out=z -q --json --resume --force --task 3/40"
            ),
            "identify a.csv --seed 3 --map"
        );
        assert_eq!(kept("identify --quiet out.csv"), "identify out.csv");
    }
}
