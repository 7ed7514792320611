//! Tests with blocked ports: pressure gain and internal leakage, and the flow curve of the same valve. The records are made here
//! in SI units from the geometry of four edges, each port's pressure by bisection.

use crate::program::{json, printed, refused, servobee, soak, value};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use std::fmt::Write;
use std::fs::write;
use std::path::Path;
use tempfile::TempDir;

const DENSITY: f64 = 850.0;
const DISCHARGE: f64 = 0.7;
/// Pa s.
const VISCOSITY: f64 = 850.0 * 18e-6;
/// From null to full opening, m.
const STROKE: f64 = 0.5e-3;
/// Width of each edge, m.
const WIDTH: f64 = 2.1e-2;

/// An edge: how far it overlaps, its clearance and the radius of both its corners together, µm.
#[derive(Clone, Copy)]
struct Edge(f64, f64, f64);

/// A valve, and what its pilot stage draws, L/min.
#[derive(Clone, Copy)]
struct Valve {
    /// P-A, A-T, P-B, B-T.
    edges: [Edge; 4],
    pilot: f64,
}

const VALVE: Valve = Valve {
    edges: [
        Edge(4.0, 3.0, 2.0),
        Edge(-2.0, 2.5, 3.0),
        Edge(6.0, 2.0, 1.0),
        Edge(1.0, 3.0, 2.0),
    ],
    pilot: 0.3,
};

impl Valve {
    /// What edge `i` passes under a `drop`, Pa, with the spool at `x`, m; m³/s.
    fn passes(&self, i: usize, x: f64, drop: f64) -> f64 {
        let Edge(lap, clearance, radius) = self.edges[i];
        let [lap, clearance, radius] =
            [lap, clearance, radius].map(|micrometres| 1e-6 * micrometres);
        let ahead = [1.0, -1.0, -1.0, 1.0][i] * x - lap + radius;
        let gap = ahead.max(0.0).hypot(clearance + radius) - radius;
        let orifice = |flow: f64| 0.5 * DENSITY * (flow / (DISCHARGE * WIDTH * gap)).powi(2);
        let film =
            |flow: f64| 12.0 * VISCOSITY * flow * (-ahead).max(0.0) / (WIDTH * clearance.powi(3));
        let most = DISCHARGE * WIDTH * gap * (2.0 * drop.abs() / DENSITY).sqrt();
        let flow = root(0.0, most * (1.0 + 1e-12), |flow| {
            drop.abs() - orifice(flow) - film(flow)
        });
        flow.copysign(drop)
    }

    /// Pressures at A and B, bar, and return flow, L/min, where both ports are blocked.
    fn blocked(&self, x: f64, supply: f64, tank: f64) -> [f64; 3] {
        let (supply, tank) = (1e5 * supply, 1e5 * tank);
        let port = |inlet: usize, outlet: usize| {
            let excess =
                |p: f64| self.passes(inlet, x, supply - p) - self.passes(outlet, x, p - tank);
            root(tank, supply, excess)
        };
        let (a, b) = (port(0, 1), port(2, 3));
        let back = self.passes(1, x, a - tank) + self.passes(3, x, b - tank);
        [1e-5 * a, 1e-5 * b, 6e4 * back + self.pilot]
    }

    /// The flow from A to B through a meter that takes no pressure, L/min.
    fn flow(&self, x: f64, supply: f64, tank: f64) -> f64 {
        let (supply, tank) = (1e5 * supply, 1e5 * tank);
        let both = |p: f64| {
            let [pa, at, pb, bt] = [
                (0, supply - p),
                (1, p - tank),
                (2, supply - p),
                (3, p - tank),
            ]
            .map(|(i, drop)| self.passes(i, x, drop));
            [pa + pb - at - bt, pa - at]
        };
        6e4 * both(root(tank, supply, |p| both(p)[0]))[1]
    }
}

/// Where `f`, which falls, is zero between two values.
fn root(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        match f(middle) > 0.0 {
            true => low = middle,
            false => high = middle,
        }
    }
    0.5 * (low + high)
}

/// A sweep of 100 s, five rows a second, and half of another.
struct Sweep {
    /// Largest command, V, of a full scale of 10 V.
    reach: f64,
    /// Supply pressure, bar.
    supply: f64,
    /// Half the width of a play between command and spool, V.
    play: f64,
}

const GAIN: Sweep = Sweep {
    reach: 0.6,
    supply: 210.0,
    play: 0.0,
};
const WHOLE: Sweep = Sweep {
    reach: 10.0,
    ..GAIN
};
const FLOW: Sweep = Sweep {
    supply: 70.0,
    ..WHOLE
};
const TANK: f64 = 2.0;

impl Sweep {
    /// The record: time, command, what `shown` gives for a spool, m, and a supply pressure, and the pressures of supply and tank.
    fn write<const N: usize>(
        &self,
        folder: &Path,
        name: &str,
        columns: [(&str, f64); N],
        shown: impl Fn(f64, f64) -> [f64; N],
    ) {
        let mut random = ChaCha8Rng::seed_from_u64(name.len() as u64);
        let mut normal = || (0..12).map(|_| random.random::<f64>() - 0.5).sum::<f64>();
        let heads = columns.map(|(head, _)| head).join(",");
        let mut text =
            format!("time [s],command [V],{heads},supply_pressure [bar],return_pressure [bar]\n");
        let mut spool = 0.0f64;
        for k in 0..750 {
            let time = 0.2 * f64::from(k);
            let phase = (time / 100.0).fract();
            let command = 4.0
                * self.reach
                * match phase {
                    _ if phase < 0.25 => phase,
                    _ if phase < 0.75 => 0.5 - phase,
                    _ => phase - 1.0,
                };
            spool = spool.clamp(command - self.play, command + self.play);
            // A supply that breathes.
            let supply = self.supply + (time / 8.0).sin();
            let values = shown(0.1 * spool * STROKE, supply);
            write!(text, "{time:.1},{command:.5}").unwrap();
            for (value, (_, noise)) in values.iter().zip(columns) {
                write!(text, ",{:.5}", value + noise * normal()).unwrap();
            }
            writeln!(text, ",{supply:.3},{TANK}").unwrap();
        }
        write(folder.join(name), text).unwrap();
    }
}

/// Records of all tests of `valve`, with a play of this half-width, V.
fn records(folder: &Path, valve: &Valve, play: f64) {
    let blocked = |x, supply| valve.blocked(x, supply, TANK);
    let sweep = |sweep: Sweep| Sweep { play, ..sweep };
    sweep(FLOW).write(folder, "flow.csv", [("flow [L/min]", 0.03)], |x, supply| {
        [valve.flow(x, supply, TANK)]
    });
    let ports = [("pressure_a [bar]", 0.3), ("pressure_b [bar]", 0.3)];
    sweep(GAIN).write(folder, "gain.csv", ports, |x, supply| {
        let [a, b, _] = blocked(x, supply);
        [a, b]
    });
    sweep(GAIN).write(
        folder,
        "load.csv",
        [("load_pressure [bar]", 0.4)],
        |x, supply| {
            let [a, b, _] = blocked(x, supply);
            [a - b]
        },
    );
    sweep(WHOLE).write(
        folder,
        "leak.csv",
        [("return_flow [L/min]", 0.005)],
        |x, supply| [blocked(x, supply)[2]],
    );
}

/// The figures of an edge in the report, in % of the stroke, with their intervals.
fn edge(report: &Value, name: &str) -> [[f64; 3]; 3] {
    let parameters = report["parameters"].as_array().unwrap();
    ["position", "clearance", "radius"].map(|what| {
        let name = format!("edge_{name}_{what}");
        let found = parameters.iter().find(|one| one["name"] == *name).unwrap();
        ["value", "low", "high"].map(|field| found[field].as_f64().unwrap())
    })
}

/// Checks that each edge is where it was made, within intervals of 99.9 %.
fn check_edges(report: &Value) {
    for (name, edge_made) in ["pa", "at", "pb", "bt"].iter().zip(VALVE.edges) {
        let Edge(lap, clearance, radius) = edge_made;
        let made = [lap, clearance, radius].map(|micrometres| 100.0 * 1e-6 * micrometres / STROKE);
        for ([found, low, high], made) in edge(report, name).into_iter().zip(made) {
            println!("{name}: {made} found {found} ({low} .. {high})");
            let half = 1.7 * 0.5 * (high - low);
            assert!(
                (found - made).abs() <= half,
                "{name}: {made}, found {found} ({low} .. {high})"
            );
            assert!(half < 0.1, "{name}: {low} .. {high}");
        }
    }
}

fn identified(folder: &Path, arguments: &[&str]) -> (Value, String) {
    let call = [
        &["identify"],
        arguments,
        &["--evaluator", "cpu", "--out", "out", "--force"],
    ]
    .concat();
    let printed = printed(&servobee(folder, &call));
    (json(folder.join("out/report.json")), printed)
}

#[test]
fn flow_pressure_gain_and_leakage_together_give_each_edge() {
    let folder = TempDir::new().unwrap();
    records(folder.path(), &VALVE, 0.0);
    let (report, printed) = identified(folder.path(), &["flow.csv", "gain.csv", "leak.csv"]);
    assert_eq!(report["verdict"], "none", "{printed}");
    check_edges(&report);
    let pilot = value(&report, "pilot_flow");
    assert!((pilot - VALVE.pilot).abs() < 0.002, "{pilot}");
    let area = value(&report, "max_area");
    assert!((area / (1e4 * WIDTH * STROKE) - 1.0).abs() < 1e-3, "{area}");
    // The card, beside what the valve was made to do at the mean pressure of these tests.
    let blocked = |x: f64| VALVE.blocked(x * STROKE, 208.0, 0.0);
    let pressure = |u: f64| (blocked(u)[0] - blocked(u)[1]) / 208.0;
    // The slope of the best straight line through the part within 40 % of the supply.
    let fine = (-40_000..=40_000).map(|k| 1e-6 * f64::from(k));
    let straight: Vec<[f64; 2]> = fine
        .step_by(20)
        .map(|u| [u, pressure(u)])
        .filter(|point| point[1].abs() <= 0.4)
        .collect();
    let mean = |i: usize| straight.iter().map(|p| p[i]).sum::<f64>() / straight.len() as f64;
    let along = |i: usize| {
        straight
            .iter()
            .map(|p| (p[0] - mean(0)) * (p[i] - mean(i)))
            .sum::<f64>()
    };
    let gain = along(1) / along(0);
    let most = (-60..=60)
        .map(|k| blocked(f64::from(k) * 1e-3)[2])
        .fold(0.0, f64::max);
    for (name, made, most_off) in [("pressure_gain", gain, 0.03), ("leakage", most, 0.01)] {
        let card = report["card"].as_array().unwrap();
        let figure = card.iter().find(|figure| figure["name"] == name).unwrap();
        let [model, measured] =
            [&figure["value"], &figure["measured"]["value"]].map(|v| v.as_f64().unwrap());
        println!("{name}: {made}, model {model}, measured {measured}");
        assert!(
            (model / made - 1.0).abs() < most_off,
            "{name}: {made} {model}"
        );
        assert!(
            (measured / made - 1.0).abs() < most_off,
            "{name}: {made} {measured}"
        );
    }
    // Rows of a test have nothing in the columns of another.
    let residual = std::fs::read_to_string(folder.path().join("out/residual.csv")).unwrap();
    let row = residual
        .lines()
        .find(|line| line.starts_with("gain,fit"))
        .unwrap();
    assert!(row.contains(",,,"), "{row}");
}

#[test]
fn a_play_is_found_in_all_tests_together() {
    let folder = TempDir::new().unwrap();
    records(folder.path(), &VALVE, 0.05);
    let tests = ["flow.csv", "leak.csv", "gain.csv"];
    let tests = &tests[..if soak() { 3 } else { 2 }];
    let (report, printed) = identified(folder.path(), tests);
    assert_eq!(report["verdict"], "found", "{printed}");
    let effects = report["effects"].as_array().unwrap();
    assert_eq!(effects.len(), 1, "{printed}");
    assert_eq!(effects[0]["name"], "hysteresis");
    let play = value(&report, "hysteresis");
    assert!((play - 0.05).abs() < 0.001, "{play}");
}

#[test]
fn of_a_load_pressure_alone_it_is_said_which_edges_can_be_exchanged() {
    let folder = TempDir::new().unwrap();
    records(folder.path(), &VALVE, 0.0);
    let (report, printed) = identified(folder.path(), &["load.csv", "leak.csv"]);
    assert_eq!(report["verdict"], "none", "{printed}");
    assert!(printed.contains("can be exchanged"), "{printed}");
    for (name, measured) in [("load", "load_pressure"), ("leak", "return_flow")] {
        let taken = format!("{name}: {measured} is measured: the ports A and B are taken to be");
        assert!(printed.contains(&taken), "{taken}: {printed}");
    }
    // Either as they were made, or exchanged.
    let positions = ["pa", "bt"].map(|name| edge(&report, name)[0][0]);
    let apart = |made: [f64; 2]| (positions[0] - made[0]).abs() + (positions[1] - made[1]).abs();
    assert!(
        apart([0.8, 0.2]).min(apart([0.2, 0.8])) < 0.3,
        "{positions:?}"
    );
}

#[test]
fn tests_that_do_not_belong_together_are_refused() {
    let folder = TempDir::new().unwrap();
    let write = |name: &str, text: &str| write(folder.path().join(name), text).unwrap();
    let rows = |head: &str, row: fn(f64) -> String| {
        let rows: Vec<String> = (0..200).map(|k| row(f64::from(k))).collect();
        format!("{head}\n{}\n", rows.join("\n"))
    };
    write(
        "flow.csv",
        &rows("time [s],command [V],flow [L/min]", |k| {
            format!("{},{},{}", 0.1 * k, (0.1 * k).sin(), 4.0 * (0.1 * k).sin())
        }),
    );
    write(
        "leak.csv",
        &rows(
            "time [s],command [V],return_flow [L/min],supply_pressure [bar]",
            |k| {
                format!(
                    "{},{},{},210",
                    0.1 * k,
                    (0.1 * k).sin(),
                    1.0 - (0.1 * k).sin().abs()
                )
            },
        ),
    );
    write(
        "both.csv",
        &rows(
            "time [s],command [V],flow [L/min],load_pressure [bar]",
            |k| {
                format!(
                    "{},{},{},{}",
                    0.1 * k,
                    (0.1 * k).sin(),
                    4.0 * (0.1 * k).sin(),
                    (0.1 * k).sin()
                )
            },
        ),
    );
    for (files, parts) in [
        (&["both.csv"][..], ["load_pressure", "blocked"]),
        (&["flow.csv", "leak.csv"], ["supply_pressure", "flow.csv"]),
    ] {
        let text = refused(&servobee(folder.path(), &[&["identify"], files].concat()));
        assert!(parts.iter().all(|part| text.contains(part)), "{text}");
    }
    let inspected = printed(&servobee(folder.path(), &["inspect", "leak.csv"]));
    let taken = "return_flow is measured: the ports A and B are taken to be blocked";
    assert!(inspected.contains(taken), "{inspected}");
}
