//! The command line of servobee.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    quiet_device_selection();
    match cli::run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            cli::colour::error(&error);
            ExitCode::from(error.exit_code())
        }
    }
}

/// Without a desktop session, Mesa's layer that picks the desktop's GPU has nothing to ask and complains on stderr about
/// every adapter.
fn quiet_device_selection() {
    let unset = |name| std::env::var_os(name).is_none();
    if unset("XDG_RUNTIME_DIR") && unset("MESA_VK_DEVICE_SELECT") {
        servobee::audited::set_variable("NODEVICE_SELECT", "1");
    }
}
