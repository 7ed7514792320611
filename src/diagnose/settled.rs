//! What the spool alone settles, where the model fails behind it and nowhere else.
//!
//! A flow that the model cannot follow bends what moves the spool, until the spool, which alone is followed to the noise, is
//! not either; whatever is then tried behind it cannot follow the flow. So what moves the spool stays as the spool alone has it
//! until the flow is followed as well: the maximum likelihood of channels of unknown noise, each of which counts by what the model
//! leaves of it.

use super::fitted::Fitted;
use super::statistics::noise::Noise;
use super::verdict::NEAR;
use crate::evaluate::Problem;
use crate::model::{Output, Outputs, Parameter};
use std::collections::BTreeMap;

/// What moves the spool, as the spool alone has it.
#[derive(Debug, Clone)]
pub(super) struct Settled {
    parameters: Vec<Parameter>,
}

impl Settled {
    /// The `parameters` of the spool, fitted alone.
    pub(super) fn new(parameters: Vec<Parameter>) -> Self {
        Self { parameters }
    }

    /// Lets what moves the spool be as the spool alone has it.
    pub(super) fn set(&self, problem: &mut Problem) {
        for (settled, own) in self.own(problem) {
            own.set_nominal(own.clamp(settled.nominal()));
        }
    }

    /// Lets it stay so.
    pub(super) fn hold(&self, problem: &mut Problem) {
        self.set(problem);
        self.own(problem).for_each(|(_, own)| own.set_fixed(true));
    }

    /// Lets it move again. Whether it was held.
    pub(super) fn release(&self, problem: &mut Problem) -> bool {
        let mut held = false;
        for (_, own) in self.own(problem) {
            held |= own.is_fixed();
            own.set_fixed(false);
        }
        held
    }

    /// What is settled, beside the parameters of `problem` of that name.
    fn own<'a>(
        &'a self,
        problem: &'a mut Problem,
    ) -> impl Iterator<Item = (&'a Parameter, &'a mut Parameter)> {
        let parameters = problem.parameters.iter_mut();
        parameters.filter_map(|own| {
            let settled = self.parameters.iter().find(|one| one.name == own.name);
            settled.map(|settled| (settled, own))
        })
    }
}

/// Whether `fitted` does not follow the spool that it was fitted to.
pub(super) fn tears(fitted: &Fitted, noise: &BTreeMap<String, Noise>) -> bool {
    let name = Output::Spool.name();
    let error = fitted.errors.fit.get(name);
    error.is_some_and(|error| error.rmse > NEAR * noise[name].value)
}

/// The weights of the channels, where the flow counts by what is left of it: so many times its noise.
pub(super) fn with_flow_left(scale: &Outputs<f64>, ratio: f64) -> Outputs<f64> {
    Outputs::from_fn(|output| match output {
        Output::Flow => scale[output] / ratio.max(1.0).powi(2),
        _ => scale[output],
    })
}

#[cfg(test)]
mod tests {
    use crate::diagnose::{Cut, IdentificationProblem, Options, identify};
    use crate::evaluate::{CpuEvaluator, Precision};
    use crate::model::base::servo_valve::{GAIN, SATURATION, TIME_CONSTANT};
    use crate::search::Plan;
    use crate::simulator::Setup;
    use std::ops::ControlFlow;

    /// A slow flow meter behind edges that overlap: a lag of the spool follows that better than none.
    #[test]
    fn a_flow_that_is_not_followed_does_not_bend_what_moves_the_spool() {
        let setup = Setup {
            seconds: 4.0,
            planted: ["sensor_lag.flow=0.02", "overlap=6"]
                .map(|one| one.parse().unwrap())
                .into(),
            ..Setup::default()
        };
        let records = [setup.record().unwrap()];
        let asked = IdentificationProblem::of(&records, &[], Cut::default()).unwrap();
        let mut evaluator = CpuEvaluator::new(Precision::F32);
        let (plan, nothing) = (Plan::of_records(1), Options::default());
        let found = identify(asked, &mut evaluator, &plan, &nothing, &mut |_| {
            ControlFlow::Continue(())
        });
        let base = found.unwrap().before;
        let names = base.problem.parameters.iter().map(|one| one.name.as_str());
        let values: Vec<(&str, f64)> = names.zip(base.values.as_slice().iter().copied()).collect();
        println!("{values:?}");
        let valve = &setup.valve;
        for (name, truth) in [
            (GAIN, valve.gain),
            (TIME_CONSTANT, valve.time_constant),
            (SATURATION, valve.saturation),
        ] {
            let (_, value) = values.iter().find(|(own, _)| *own == name).unwrap();
            assert!(
                (value / truth - 1.0).abs() < 0.02,
                "{name}: {value} instead of {truth}"
            );
        }
        // The flow still counts for what only it shows.
        let flow = &base.errors.fit["flow"];
        assert!(flow.fit_percent.unwrap() > 30.0, "{flow:?}");
    }
}
