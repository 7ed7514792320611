//! What a crate that depends on servobee does: read a record, diagnose it with an effect of its own beside the catalogue.

use servobee::Session;
use servobee::evaluate::{Choice, choose};
use servobee::model::effects::{Act, CATALOGUE, Entry, Law, Port, register};
use servobee::model::{Parameter, Real};
use std::ops::ControlFlow;

/// An amplifier that bends: u + bend · u · |u|.
struct Bend<R>(R);

impl<R: Real> Act<R> for Bend<R> {
    fn command(&self, _own: &mut [R], command: R) -> R {
        command + self.0 * command * command.abs()
    }
}

struct BendLaw;

impl Law for BendLaw {
    type Act<R: Real> = Bend<R>;
    fn act<R: Real>(next: &mut dyn FnMut() -> R) -> Bend<R> {
        Bend(next())
    }
}

fn main() -> servobee::Result<()> {
    let bend = register::<BendLaw>(Entry {
        name: "bend",
        port: Port::Command,
        summary: "The amplifier bends",
        finding: "the amplifier bends by {bend}",
        equation: "u + bend u |u|",
        shows: "an error that grows with the square of the command",
        confused: "gain_curvature, which the spool does not show",
        source: "the amplifier's data sheet",
        parameters: |scale, _| {
            let most = 0.5 / scale.command;
            vec![Parameter::linear("bend", "1", -most, 0.0, most)]
        },
        trials: |scale, _| vec![vec![0.05 / scale.command]],
        imitated_by: &[],
        states: &[],
        neutral: &[],
        applies: |_| true,
        outputs: None,
        view: None,
        frequency: None,
    })?;
    let session = Session {
        effects: [CATALOGUE, &[bend]].concat(),
        ..Session::default()
    };
    let path = std::env::args().nth(1).expect("a record");
    let records = session.read(&[path])?;
    let mut chosen = choose(Choice::Cpu)?;
    let mut progress = |_: &str| ControlFlow::Continue(());
    let found = session.identify(&records, &[], &mut chosen, &mut progress)?;
    for added in &found.identified.added {
        println!("{}", added.effect);
    }
    Ok(())
}
