//! `servobee completions`.

use clap::{Command, ValueEnum};
use clap_complete::Shell;
use servobee::Result;

/// Writes the completions of the command line for a shell
#[derive(clap::Args)]
#[command(after_help = "Examples:
  servobee completions bash > ~/.local/share/bash-completion/completions/servobee
  servobee completions zsh > ~/.zfunc/_servobee
  servobee completions fish > ~/.config/fish/completions/servobee.fish")]
pub(super) struct Arguments {
    /// The shell
    #[arg(value_name = shells())]
    shell: Shell,
}

fn shells() -> String {
    let names = Shell::value_variants().iter().map(ToString::to_string);
    names.collect::<Vec<_>>().join("|")
}

pub(super) fn run(arguments: &Arguments, mut command: Command) -> Result<()> {
    let mut text = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "servobee", &mut text);
    super::out::write(format_args!("{}", String::from_utf8_lossy(&text)));
    Ok(())
}
