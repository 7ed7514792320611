//! A MATLAB script that gives Simscape's blocks the parameters of a model, and says what these blocks cannot represent.

use super::Model;
use crate::model::edges::edge_name;
use crate::model::effects::Port;
use crate::model::orifice::{CRITICAL_REYNOLDS, LAMINAR_RATIO, Transition};
use crate::model::valve::{AreaLaw, Drop, LEAKAGE_AREA, Meter, Orifices, ValveForm};
use crate::model::{Hold, Initial, Output, Parameter, Polarity};
use std::fmt::Write;

/// No spool goes so many times as far as full scale.
const FARTHEST: f64 = 10.0;

/// The script for "Proportional and Servo-Valve Actuator" and "4-Way Directional Valve".
pub fn script(model: &Model) -> String {
    let mut text = format!(
        "%% {}\n% Sets the parameters of two blocks of Simscape Fluids (hydraulics):\n\
         %   actuator  Proportional and Servo-Valve Actuator\n%   valve     4-Way Directional Valve\n\
         % The parameter names are those of the Hydraulics (Isothermal) library; where releases differ both are there, and the\n\
         % first that the block knows is set. One that it does not know is reported and skipped. The script was written\n\
         % without a MATLAB at hand: compare with fieldnames(get_param(valve, 'DialogParameters')). The comment at each line\n\
         % is the label in the block's dialog.\n\
         % What the blocks cannot represent is listed at the end, with its equations and values.\n\n",
        model.summary()
    );
    text += "actuator = 'model/Actuator';   % path of the actuator block\n\
             valve = 'model/Valve';         % path of the valve block\n\n";
    text += &blocks(model);
    text += &missing(model);
    text += "\nfunction assign(block, names, value)\n    for k = 1:numel(names)\n        try\n            \
             set_param(block, names{k}, value);\n            return\n        catch\n        end\n    end\n    \
             warning('servobee:parameter', '%s: %s is not set', block, strjoin(names, ' or '));\nend\n";
    text
}

/// The parameters of both blocks.
fn blocks(model: &Model) -> String {
    let structure = &model.structure;
    if structure.servo_valve().is_none() {
        let name = structure.base.name();
        return format!("% The base model is {name}, which neither block represents.\n\n");
    }
    let mut text = match structure.has(Port::Actuator) {
        true => actuator(model),
        false => "% The spool follows the command at once: the model has no actuator.\n\n".into(),
    };
    match structure.valve() {
        Some(form) => text += &valve(model, form),
        None => text += "% No flow is observed: the model has no valve.\n\n",
    }
    text
}

/// The value of a parameter.
fn value(model: &Model, name: &str) -> f64 {
    let found = model.parameters.iter().find(|p| p.name == name);
    found.map_or(0.0, |parameter| parameter.nominal())
}

/// `names` is what the parameter is called in newer and, behind a blank, in older releases.
fn assign(text: &mut String, block: &str, names: &str, value: &str, comment: &str) {
    let names = names.replace(' ', "', '");
    let _ = writeln!(
        text,
        "assign({block}, {{'{names}'}}, '{value}');   % {comment}"
    );
}

fn actuator(model: &Model) -> String {
    let unit = &model.structure.command_unit;
    let mut text = format!(
        "%% Actuator: gain, lag and saturation of the error in a unity feedback loop\n\
         % Its input is the command in {unit}, full scale {:?} {unit}; its output is the spool position in the same unit.\n",
        model.structure.full_scale
    );
    for (name, parameter, comment) in [
        ("gain", "gain", "Gain, 1/s".to_owned()),
        (
            "time_constant",
            "time_constant",
            "Time constant, s".to_owned(),
        ),
        ("saturation", "saturation", format!("Saturation, {unit}")),
    ] {
        let number = format!("{:?}", value(model, parameter));
        assign(&mut text, "actuator", name, &number, &comment);
    }
    text.push('\n');
    text
}

/// What is put: a parameter's name, value and comment.
type Put<'a> = &'a mut dyn FnMut(&str, &str, &str);

/// The area over the opening, the same for all four orifices; older releases have no choice.
fn area(model: &Model, form: &ValveForm, put: Put<'_>) {
    let of = |name: &str| value(model, name);
    match &form.area {
        AreaLaw::Linear | AreaLaw::Proportional => {
            // The block's area ends at its maximum opening.
            let most = match form.area {
                AreaLaw::Linear => 1.0,
                _ => FARTHEST,
            };
            put(
                "mdl_type_identical mdl_type",
                "1",
                "By maximum area and opening",
            );
            put(
                "area_max",
                &format!("{:?}", most * of("max_area")),
                "Maximum orifice area, cm^2",
            );
            put("area_max_unit", "cm^2", "its unit");
            let end = 100.0 * most;
            put(
                "opening_max",
                &format!("{end}"),
                &format!("Maximum opening, mm: {end} %"),
            );
            put("opening_max_unit", "mm", "its unit");
        }
        AreaLaw::Table(openings) => {
            let list = |values: Vec<String>| format!("[{}]", values.join(" "));
            let area = |i: usize| format!("{:?}", of(&format!("area_{}", i + 1)));
            put(
                "mdl_type_identical mdl_type",
                "2",
                "By area vs. opening table",
            );
            let values = openings
                .iter()
                .map(|opening| format!("{opening:?}"))
                .collect();
            put(
                "opening_area_tab opening_tab",
                &list(values),
                "Openings, mm: %",
            );
            put("opening_area_tab_unit opening_tab_unit", "mm", "its unit");
            put(
                "area_tab",
                &list((0..openings.len()).map(area).collect()),
                "Areas, cm^2",
            );
            put("area_tab_unit", "cm^2", "its unit");
            put(
                "interp_method_identical interp_method",
                "1",
                "Linear interpolation",
            );
            put(
                "extrap_method_identical extrap_method",
                "2",
                "Nearest extrapolation: the end value holds",
            );
        }
        // One table for all orifices cannot say what differs between the sides.
        AreaLaw::Signed(_) => {}
        // Nor what differs between the edges.
        AreaLaw::Edges => {}
    }
}

fn laminar(form: &ValveForm, put: Put<'_>) {
    match form.transition {
        Transition::PressureRatio => {
            put("lam_spec", "1", "Laminar transition by pressure ratio");
            put(
                "B_lam",
                &format!("{LAMINAR_RATIO:?}"),
                "Laminar flow pressure ratio",
            );
        }
        Transition::Reynolds => {
            put("lam_spec", "2", "Laminar transition by Reynolds number");
            put(
                "Re_cr",
                &format!("{CRITICAL_REYNOLDS:?}"),
                "Critical Reynolds number",
            );
        }
    }
}

fn valve(model: &Model, form: &ValveForm) -> String {
    let of = |name: &str| value(model, name);
    let mut text = format!(
        "%% Valve\n% Its spool is displaced by x [mm] where the model's spool is at x % of full scale: put a gain of \
         100/{:?} between\n% actuator and valve, and a Simulink-PS Converter with unit mm.\n",
        model.structure.full_scale
    );
    let mut put =
        |name: &str, value: &str, comment: &str| assign(&mut text, "valve", name, value, comment);
    area(model, form, &mut put);
    put(
        "C_d",
        &format!("{:?}", of("discharge_coefficient")),
        "Flow discharge coefficient",
    );
    put(
        "A_leak",
        &format!("{:?}", of(LEAKAGE_AREA)),
        "Leakage area, cm^2",
    );
    put("A_leak_unit", "cm^2", "its unit");
    for orifice in ["P_A", "P_B", "A_T", "B_T"] {
        let name = format!("x_0_{orifice}");
        put(
            &name,
            &format!("{:?}", of("opening_offset")),
            "Initial opening, mm: %",
        );
        put(&format!("{name}_unit"), "mm", "its unit");
    }
    laminar(form, &mut put);
    let _ = writeln!(
        text,
        "% The fluid is a block of its own (Custom Hydraulic Fluid): density {:?} kg/m^3, kinematic viscosity {:?} cSt.",
        of("density"),
        of("viscosity")
    );
    text += match form.drop {
        Drop::Rated => "",
        Drop::Supply => {
            "% P and T follow the measured supply and return pressure, A and B lie midway between them.\n"
        }
        Drop::Ports => "% P, T, A and B follow the measured pressures.\n",
    };
    if form.drop == Drop::Rated {
        let rated = of("rated_drop");
        let _ = writeln!(
            text,
            "% The flow was fitted at a rated drop of {rated:?} bar from P to T, half of it at each land."
        );
    }
    text += match form.meter {
        Meter::Load => {
            "% The fitted flow is that of the load, the mean of what leaves A and what returns to B.\n\n"
        }
        Meter::Supply => "% The fitted flow is what the supply delivers.\n\n",
    };
    text
}

/// What the two blocks have no parameter for.
fn missing(model: &Model) -> String {
    let structure = &model.structure;
    let mut list: Vec<String> = Vec::new();
    // The parameters of the effects follow those of the base model, in order.
    let base = structure
        .effects
        .iter()
        .fold(structure.clone(), |rest, &effect| rest.without(effect));
    let corrections = structure
        .free_form
        .as_ref()
        .map_or(0, |form| form.knots.len());
    let mut next = base.parameters().len() - corrections;
    for effect in &structure.effects {
        let entry = effect.entry;
        let mut item = format!("{effect}: {}\n%   {}", entry.summary, entry.equation);
        let count = base.with(*effect).parameters().len() - base.parameters().len();
        for parameter in &model.parameters[next..next + count] {
            let Parameter { name, unit, .. } = parameter;
            let _ = write!(item, "\n%   {name} = {:?} {unit}", parameter.nominal());
        }
        next += count;
        list.push(item);
    }
    if let Some(form) = &structure.free_form {
        let values: Vec<String> = (1..=form.knots.len())
            .map(|i| format!("{:?}", value(model, &format!("correction_{i}"))))
            .collect();
        list.push(format!(
            "a curve of unknown origin, added at the {} port: linear in the {} [{}] between its knots\n%   \
             knots = {:?}\n%   values = [{}]",
            form.port,
            form.signal.name(),
            form.signal_unit(&structure.command_unit),
            form.knots,
            values.join(", ")
        ));
    }
    if let Some(AreaLaw::Signed(openings)) = structure.valve().map(|form| &form.area) {
        let areas: Vec<f64> = (1..=openings.len())
            .map(|i| value(model, &format!("area_{i}")))
            .collect();
        let side = |sign: f64| -> Vec<f64> {
            let open = areas.iter().map(|area| (sign * area).max(0.0));
            open.collect()
        };
        list.push(format!(
            "areas that differ between the sides (use an orifice block with a table for each path)\n%   openings [%] = \
             {openings:?}\n%   P-A and B-T [cm2] = {:?}\n%   P-B and A-T [cm2] = {:?}",
            side(1.0),
            side(-1.0)
        ));
    }
    if let Some(AreaLaw::Edges) = structure.valve().map(|form| &form.area) {
        let edges: Vec<String> = (0..4)
            .map(|number| {
                let of = |what: &str| value(model, &edge_name(number, what));
                format!(
                    "\n%   position {:?}, clearance {:?}, radius {:?}",
                    of("position"),
                    of("clearance"),
                    of("radius")
                )
            })
            .collect();
        list.push(format!(
            "the four metering edges (use an orifice block with a table for each path): area max_area = {:?} cm2 at 100 %, and of \
             P-A, A-T, P-B and B-T in %{}",
            value(model, "max_area"),
            edges.concat()
        ));
    }
    if let Some(Orifices::Six) = structure.valve().map(|form| form.orifices) {
        list.push(
            "the centre path of six orifices, P-T1 and T1-T in series (use six orifice blocks)"
                .into(),
        );
    }
    if let Some(unit) = structure.spool_unit() {
        list.push(format!(
            "the spool's sensor: spool [{unit}] = {:?} times the spool in {}",
            value(model, "spool_gain"),
            structure.command_unit
        ));
    }
    if structure
        .servo_valve()
        .is_some_and(|base| base.polarity == Polarity::Negative)
    {
        list.push("negative polarity: exchange A and B".into());
    }
    if structure.observes(Output::Position) && structure.integrates_position() {
        let sign = if structure.servo_valve().is_some_and(|base| base.reversed) {
            "-"
        } else {
            ""
        };
        list.push(format!(
            "the piston: its speed is {sign}flow over piston_area = {:?} cm2 (use a cylinder block)",
            value(model, "piston_area")
        ));
    }
    match structure.initial {
        Initial::Equilibrium => list.push(
            "the start in equilibrium with the first command: the actuator starts at zero".into(),
        ),
        Initial::Free => list.push(format!(
            "the start of the spool at {:?} {}: the actuator starts at zero",
            value(model, "initial_spool"),
            structure.command_unit
        )),
        Initial::Rest => {}
    }
    if structure.hold == Hold::Held {
        list.push(
            "commands that are held between samples (put a Zero-Order Hold before the actuator)"
                .into(),
        );
    }
    let mut text = String::from("%% What these blocks cannot represent\n");
    for item in list {
        let _ = writeln!(text, "% - {item}");
    }
    text
}
