//! The Bees Algorithm: what it counts, keeps, forgets and never does.

use proptest::prelude::*;
use servobee::evaluate::{Cost, Population, Status};
use servobee::model::Parameter;
use servobee::search::{Bees, Moves, Neighbourhood, Search, Settings, Start, Variant};

const STANDARD: Variant = Variant::Standard {
    alpha: 0.8,
    stlim: 10,
};

fn space(dimension: usize) -> Vec<Parameter> {
    vec![Parameter::linear("x", "1", -5.0, 1.0, 5.0); dimension]
}

fn sphere(candidate: &[f64]) -> Cost {
    Cost::finished(candidate.iter().map(|x| (x - 1.5).powi(2)).sum())
}

fn step(bees: &mut Bees, cost: impl Fn(&[f64]) -> Cost) -> Population {
    let population = bees.ask();
    let costs: Vec<_> = population.iter().map(cost).collect();
    bees.tell(&costs);
    population
}

fn run(mut bees: Bees, cost: impl Fn(&[f64]) -> Cost) -> Bees {
    while !bees.finished() {
        step(&mut bees, &cost);
    }
    bees
}

#[test]
fn the_papers_settings_take_2755_evaluations() {
    let bees = Bees::new(&space(3), Settings::paper(), Start::Uniform, 1).unwrap();
    let bees = run(bees, sphere);
    assert_eq!(bees.evaluations(), 2755);
    assert_eq!(bees.generation(), 20);
    assert_eq!(bees.history().len(), 21);
}

#[test]
fn a_generation_is_asked_for_at_once() {
    let settings = Settings::paper();
    let mut bees = Bees::new(&space(3), settings, Start::Uniform, 1).unwrap();
    assert_eq!(step(&mut bees, sphere).len(), 15);
    assert_eq!(step(&mut bees, sphere).len(), 5 * 20 + 3 * 10 + 7);
    assert_eq!(settings.per_generation(), 137);
}

#[test]
fn the_same_seed_gives_the_same_search() {
    let search = |seed| {
        let bees = Bees::new(&space(4), Settings::paper(), Start::Uniform, seed).unwrap();
        run(bees, sphere)
    };
    assert_eq!(search(7), search(7));
    assert_ne!(search(7).best(), search(8).best());
}

#[test]
fn asking_twice_gives_the_same_generation() {
    let mut bees = Bees::new(&space(4), Settings::paper(), Start::Uniform, 1).unwrap();
    assert_eq!(bees.ask(), bees.ask());
    let first = step(&mut bees, sphere);
    assert_ne!(bees.ask(), first);
}

#[test]
fn a_copy_goes_on_like_the_original() {
    let mut bees = Bees::new(&space(4), Settings::paper(), Start::Uniform, 1).unwrap();
    step(&mut bees, sphere);
    assert_eq!(run(bees.clone(), sphere), run(bees, sphere));
}

#[test]
fn a_given_start_is_the_first_scout() {
    let given = vec![0.1, -0.7, 4.9];
    for start in [Start::From(given.clone()), Start::Near(given.clone())] {
        let near = matches!(start, Start::Near(_));
        let mut bees = Bees::new(&space(3), Settings::paper(), start, 1).unwrap();
        let scouts = bees.ask();
        assert_eq!(scouts.len(), 15);
        assert_eq!(scouts.candidate(0), given);
        let close = |x: &[f64]| x.iter().zip(&given).all(|(x, g)| (x - g).abs() <= 0.1001);
        assert_eq!(scouts.iter().all(close), near);
    }
}

#[test]
fn a_candidate_that_is_already_best_stays_best() {
    let best = vec![1.5; 21];
    let start = Start::From(best.clone());
    let bees = Bees::new(&space(21), Settings::paper(), start, 1).unwrap();
    assert_eq!(run(bees, sphere).best(), (&best[..], Cost::finished(0.0)));
}

#[test]
fn the_sphere_is_solved() {
    for (variant, bound) in [(Variant::Basic, 1e-2), (STANDARD, 1e-12)] {
        let settings = Settings {
            itr: 100,
            ngh: Neighbourhood::Relative(0.05),
            variant,
            ..Settings::paper()
        };
        let bees = Bees::new(&space(3), settings, Start::Uniform, 1).unwrap();
        let best = run(bees, sphere).best().0.to_vec();
        assert!(sphere(&best).value < bound, "{variant:?}: {best:?}");
    }
}

/// The published areas of the D675, read as a flow that grows with a 21st, common factor.
#[test]
fn from_hand_set_values_the_paper_fits_21_parameters() {
    let areas = [
        0.0, 0.0, 0.0, 0.6983, 1.1992, 1.6193, 2.1, 2.6, 3.0724, 3.6808, 4.2893, 4.7984, 5.2496,
        5.7222, 6.0858, 6.514, 6.8634, 7.139, 7.4, 7.598,
    ];
    let flow = |areas: &[f64], factor: f64| -> Vec<f64> {
        let line = |i: usize| (i / 10, (i % 10) as f64 / 10.0);
        let between = |(k, part)| factor * (areas[k] * (1.0 - part) + areas[k + 1] * part);
        (0..190).map(line).map(between).collect()
    };
    let wanted = flow(&areas, 3.5);
    let size: f64 = wanted.iter().map(|q| q * q).sum();
    let error = |x: &[f64]| {
        let found = flow(&x[..20], x[20]);
        let sum: f64 = found
            .iter()
            .zip(&wanted)
            .map(|(f, w)| (f - w).powi(2))
            .sum();
        (sum / size).sqrt()
    };
    let mut parameters = vec![Parameter::linear("area", "cm2", 0.0, 0.0, 10.0); 20];
    parameters.push(Parameter::linear("factor", "1", 2.0, 3.5, 5.0));
    let mut given: Vec<_> = (0..20).map(|i| 0.45 * i as f64).collect();
    given.push(3.5);
    assert!(error(&given) > 0.1);

    let fit = |start| {
        let bees = Bees::new(&parameters, Settings::paper(), start, 1).unwrap();
        error(run(bees, |x| Cost::finished(error(x))).best().0)
    };
    let (near, from) = (fit(Start::Near(given.clone())), fit(Start::From(given)));
    assert!(near < from && from < 0.04, "{near} and {from}");
    assert!(fit(Start::Uniform) > 0.2);
}

#[test]
fn the_large_settings_solve_three_parameters_on_log_scales() {
    let parameters = [
        Parameter::log("K", "1/s", 10.0, 377.0, 5000.0),
        Parameter::log("T", "s", 1e-4, 2e-3, 0.1),
        Parameter::log("S", "V", 0.05, 0.3, 50.0),
    ];
    let wanted = [253.7128, 0.0211, 12.4498];
    let cost = |x: &[f64]| {
        let error = |(x, w): (&f64, f64)| (x / w).ln().powi(2);
        Cost::finished(x.iter().zip(wanted).map(error).sum())
    };
    let bees = Bees::new(&parameters, Settings::large(), Start::Uniform, 1).unwrap();
    let bees = run(bees, cost);
    for (x, w) in bees.best().0.iter().zip(wanted) {
        assert!((x / w - 1.0).abs() < 1e-6, "{x} is not {w}");
    }
}

#[test]
fn a_log_scale_is_searched_in_ratios() {
    let parameters = [Parameter::log("x", "1", 1e-6, 1.0, 1e6)];
    let settings = Settings {
        n: 4000,
        ..Settings::paper()
    };
    let scouts = Bees::new(&parameters, settings, Start::Uniform, 1)
        .unwrap()
        .ask();
    let below_one = scouts.iter().filter(|x| x[0] < 1.0).count();
    assert!((1900..2100).contains(&below_one), "{below_one} of 4000");

    let near = Bees::new(&parameters, settings, Start::Near(vec![1.0]), 1)
        .unwrap()
        .ask();
    let reach = 1e12_f64.powf(0.01) * 1.0001;
    assert!(near.iter().all(|x| (1.0 / reach..=reach).contains(&x[0])));
    assert!(near.iter().any(|x| x[0] > 1.25));
}

#[test]
fn an_absolute_neighbourhood_is_in_the_parameters_unit() {
    let settings = Settings {
        n: 1000,
        ngh: Neighbourhood::Absolute(0.25),
        ..Settings::paper()
    };
    let parameters = [
        Parameter::linear("a", "1", -5.0, 0.0, 5.0),
        Parameter::log("b", "1", 0.1, 1.0, 1e3),
    ];
    let start = Start::Near(vec![2.0, 1.0]);
    let scouts = Bees::new(&parameters, settings, start, 1).unwrap().ask();
    for (index, centre) in [2.0, 1.0].into_iter().enumerate() {
        let reach = scouts
            .iter()
            .map(|x| (x[index] - centre).abs())
            .fold(0.0, f64::max);
        assert!((0.24..=0.25).contains(&reach), "{reach}");
    }
}

#[test]
fn one_coordinate_moves_change_one_coordinate() {
    let settings = Settings {
        moves: Moves::OneCoordinate,
        ..Settings::paper()
    };
    let given = vec![0.3; 5];
    let start = Start::Near(given.clone());
    let scouts = Bees::new(&space(5), settings, start, 1).unwrap().ask();
    let mut moved = [0; 5];
    for scout in scouts.iter().skip(1) {
        let changed: Vec<_> = (0..5).filter(|&i| scout[i] != given[i]).collect();
        assert_eq!(changed.len(), 1);
        moved[changed[0]] += 1;
    }
    assert!(moved.iter().filter(|&&count| count > 0).count() > 2);
}

#[test]
fn differences_join_selected_sites() {
    let settings = Settings {
        n: 2,
        m: 2,
        e: 1,
        nep: 400,
        ngh: Neighbourhood::Absolute(1e-9),
        moves: Moves::Differences,
        ..Settings::paper()
    };
    let mut bees = Bees::new(&space(2), settings, Start::Uniform, 1).unwrap();
    let sites = step(&mut bees, |x| Cost::finished(x[0]));
    let recruits = bees.ask();
    let gap: Vec<_> = (0..2)
        .map(|i| (sites.candidate(0)[i] - sites.candidate(1)[i]).abs())
        .collect();
    let site = sites.iter().min_by(|a, b| a[0].total_cmp(&b[0])).unwrap();
    let (mut stayed, mut followed) = (0, 0);
    for bee in recruits.iter().take(400) {
        for i in 0..2 {
            let step = (bee[i] - site[i]).abs();
            let clamped = bee[i].abs() == 5.0;
            match step {
                _ if step <= 1.1e-9 => stayed += 1,
                _ if clamped || (step - gap[i] / 2.0).abs() < 1e-12 => followed += 1,
                _ => panic!("{bee:?} is on no way between the sites"),
            }
        }
    }
    assert!(stayed > 400 && followed > 200, "{stayed} and {followed}");
}

#[test]
fn differences_follow_a_narrow_valley() {
    let valley = |x: &[f64]| {
        let [a, b, c] = [x[0] - x[1], x[1] - x[2], x[0] + x[1] + x[2] - 4.5];
        Cost::finished(1e-4 * (a * a + b * b) + c * c)
    };
    let cost = |moves| {
        let settings = Settings {
            moves,
            ..Settings::standard()
        };
        let bees = Bees::new(&space(3), settings, Start::Uniform, 1).unwrap();
        run(bees, valley).best().1.value
    };
    let (box_moves, differences) = (cost(Moves::AllCoordinates), cost(Moves::Differences));
    assert!(differences < 1e-16, "{differences}");
    assert!(differences < 1e-3 * box_moves, "{differences} {box_moves}");
}

/// A single site searched until nothing better is found: its neighbourhood shrinks, and after
/// `stlim` generations it is given up for a scout.
#[test]
fn a_stagnant_site_shrinks_and_is_abandoned() {
    let settings = Settings {
        itr: 10,
        n: 2,
        m: 1,
        e: 1,
        nep: 200,
        nsp: 1,
        ngh: Neighbourhood::Relative(0.1),
        moves: Moves::AllCoordinates,
        variant: Variant::Standard {
            alpha: 0.8,
            stlim: 3,
        },
    };
    let peak = vec![1.5];
    let start = Start::From(peak.clone());
    let mut bees = Bees::new(&space(1), settings, start, 1).unwrap();
    let reach = |population: &Population| {
        let recruits = population.iter().take(200);
        recruits.map(|x| (x[0] - 1.5).abs()).fold(0.0, f64::max)
    };
    step(&mut bees, sphere);
    for size in [1.0, 0.8, 0.64] {
        let reach = reach(&step(&mut bees, sphere));
        assert!((0.95 * size..=size).contains(&reach), "{reach} for {size}");
    }
    let next = step(&mut bees, sphere);
    assert_eq!(next.len(), settings.per_generation());
    assert!(reach(&next) > 1.0, "the abandoned site is searched again");
    assert_eq!(bees.best(), (&peak[..], Cost::finished(0.0)));
}

#[test]
fn a_basic_neighbourhood_keeps_its_size() {
    let start = Start::From(vec![1.5]);
    let mut bees = Bees::new(&space(1), Settings::paper(), start, 1).unwrap();
    for _ in 0..30 {
        step(&mut bees, sphere);
    }
    let recruits = bees.ask();
    let reach = recruits
        .iter()
        .take(20)
        .map(|x| (x[0] - 1.5).abs())
        .fold(0.0, f64::max);
    assert!((0.08..=0.1).contains(&reach), "{reach}");
}

/// Every place costs the same, so that every site stagnates at once and all are abandoned.
#[test]
fn a_colony_without_sites_starts_anew() {
    let settings = Settings {
        n: 8,
        variant: Variant::Standard {
            alpha: 0.5,
            stlim: 2,
        },
        ..Settings::paper()
    };
    let mut bees = Bees::new(&space(2), settings, Start::Uniform, 1).unwrap();
    let sizes: Vec<_> = (0..4)
        .map(|_| step(&mut bees, |_| Cost::finished(1.0)).len())
        .collect();
    assert_eq!(sizes, [8, 130, 130, 8]);
}

#[test]
fn diverged_candidates_are_never_selected_over_finished_ones() {
    let settings = Settings {
        n: 16,
        m: 2,
        e: 1,
        ..Settings::paper()
    };
    let mut bees = Bees::new(&space(1), settings, Start::Uniform, 1).unwrap();
    let scouts = bees.ask();
    let mut costs = vec![Cost::DIVERGED; 16];
    costs[3] = Cost::finished(f64::NAN);
    costs[5] = Cost::finished(1e300);
    costs[9] = Cost::finished(f64::MAX);
    bees.tell(&costs);
    assert_eq!(bees.best(), (scouts.candidate(5), costs[5]));
    let recruits = bees.ask();
    for (recruit, scout) in [(0, 5), (19, 5), (20, 9), (29, 9)] {
        let distance = recruits.candidate(recruit)[0] - scouts.candidate(scout)[0];
        assert!(distance.abs() <= 0.1001);
    }
}

#[test]
fn where_everything_diverges_the_start_values_are_reported() {
    let bees = Bees::new(&space(2), Settings::paper(), Start::Uniform, 1).unwrap();
    let bees = run(bees, |_| Cost::DIVERGED);
    assert_eq!(bees.best(), (&[1.0, 1.0][..], Cost::DIVERGED));
    assert_eq!(bees.evaluations(), 2755);
}

#[test]
fn settings_that_make_no_sense_are_refused_by_name() {
    let good = Settings::paper();
    good.check().unwrap();
    Settings::standard().check().unwrap();
    Settings::large().check().unwrap();
    let ngh = |ngh| Settings { ngh, ..good };
    let variant = |alpha, stlim| Settings {
        variant: Variant::Standard { alpha, stlim },
        ..good
    };
    let bad = [
        ("itr", Settings { itr: 0, ..good }),
        ("n", Settings { n: 0, ..good }),
        ("m", Settings { m: 0, ..good }),
        ("m", Settings { m: 16, ..good }),
        ("e", Settings { e: 0, ..good }),
        ("e", Settings { e: 9, ..good }),
        ("nep", Settings { nep: 0, ..good }),
        ("nsp", Settings { nsp: 0, ..good }),
        (
            "nep",
            Settings {
                nep: usize::MAX,
                ..good
            },
        ),
        ("ngh", ngh(Neighbourhood::Relative(0.0))),
        ("ngh", ngh(Neighbourhood::Relative(1.5))),
        ("ngh", ngh(Neighbourhood::Absolute(-0.1))),
        ("ngh", ngh(Neighbourhood::Absolute(f64::NAN))),
        ("ngh", ngh(Neighbourhood::Absolute(f64::INFINITY))),
        ("alpha", variant(1.0, 10)),
        ("alpha", variant(f64::NAN, 10)),
        ("stlim", variant(0.8, 0)),
    ];
    for (name, settings) in bad {
        let error = Bees::new(&space(2), settings, Start::Uniform, 1).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        let place = format!("Bees setting {name}:");
        assert!(error.to_string().starts_with(&place), "{error}");
    }
}

#[test]
fn spaces_and_starts_that_make_no_sense_are_refused() {
    let refused = |parameters: &[Parameter], start| {
        Bees::new(parameters, Settings::paper(), start, 1)
            .unwrap_err()
            .to_string()
    };
    assert!(refused(&[], Start::Uniform).contains("none is free"));
    for bad in [
        Parameter::linear("a", "1", 1.0, 1.0, 1.0),
        Parameter::linear("a", "1", 2.0, 1.0, 1.0),
        Parameter::linear("a", "1", f64::NAN, 1.0, 1.0),
        Parameter::linear("a", "1", 0.0, 1.0, f64::INFINITY),
        Parameter::log("a", "1", 0.0, 1.0, 2.0),
    ] {
        assert!(refused(&[bad], Start::Uniform).contains("parameter a"));
    }
    assert!(refused(&space(2), Start::From(vec![1.0])).contains("1 values for 2"));
    assert!(refused(&space(1), Start::Near(vec![5.1])).contains("outside -5 to 5"));
    assert!(refused(&space(1), Start::From(vec![f64::NAN])).contains("outside"));
}

fn any_settings() -> impl Strategy<Value = Settings> {
    let variant = prop_oneof![
        Just(Variant::Basic),
        (0.1..0.99, 1..5usize).prop_map(|(alpha, stlim)| Variant::Standard { alpha, stlim }),
    ];
    let ngh = prop_oneof![
        (1e-6..=1.0).prop_map(Neighbourhood::Relative),
        (1e-6..1e6).prop_map(Neighbourhood::Absolute),
    ];
    let moves = prop_oneof![
        Just(Moves::OneCoordinate),
        Just(Moves::AllCoordinates),
        Just(Moves::Differences),
    ];
    let sites = (1..12usize)
        .prop_flat_map(|n| (Just(n), 1..=n))
        .prop_flat_map(|(n, m)| (Just(n), Just(m), 1..=m));
    let counts = (1..8usize, 1..8usize, 1..8usize);
    (sites, counts, ngh, moves, variant).prop_map(
        |((n, m, e), (itr, nep, nsp), ngh, moves, variant)| Settings {
            itr,
            n,
            m,
            e,
            nep,
            nsp,
            ngh,
            moves,
            variant,
        },
    )
}

proptest! {
    #[test]
    fn candidates_keep_the_bounds_and_the_best_never_gets_worse(
        settings in any_settings(),
        seed: u64,
        start in 0..3usize,
    ) {
        let parameters = [
            Parameter::linear("a", "1", -1e3, 0.0, 1e-3),
            Parameter::linear("b", "1", 0.1, 0.2, 0.3),
            Parameter::log("c", "1", 1e-7, 1e-3, 0.3),
        ];
        let given = vec![0.0, 0.3, 1e-7];
        let start = [Start::Uniform, Start::From(given.clone()), Start::Near(given)][start].clone();
        // Finishes on half of the space only, and never near the start.
        let cost = |x: &[f64]| match x[1] {
            b if b < 0.2 => Cost::finished((x[0] + 3.0).powi(2) + b * x[2].ln().powi(2)),
            _ => Cost::DIVERGED,
        };
        let mut bees = Bees::new(&parameters, settings, start, seed).unwrap();
        let mut judged = 0;
        let mut best = Cost::DIVERGED;
        while !bees.finished() {
            let population = step(&mut bees, cost);
            prop_assert!((settings.n..=settings.per_generation()).contains(&population.len()));
            judged += population.len();
            for candidate in population.iter() {
                for (value, parameter) in candidate.iter().zip(&parameters) {
                    prop_assert!((parameter.low..=parameter.high).contains(value));
                }
                best = best.min(cost(candidate));
            }
            prop_assert_eq!(bees.best().1, best);
            prop_assert_eq!(cost(bees.best().0).status, best.status);
        }
        prop_assert_eq!(bees.evaluations(), judged);
        prop_assert_eq!(bees.generation(), settings.itr);
        prop_assert!(bees.history().is_sorted_by(|earlier, later| earlier >= later));
        let any_finished = bees.history().iter().any(|c| c.status == Status::Finished);
        prop_assert_eq!(any_finished, best.status == Status::Finished);
    }
}
