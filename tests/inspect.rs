//! `servobee inspect` says what a file holds, also one that no record can be read from, and proposes the mappings.

use crate::program::{measured, printed, refused, servobee};
use proptest::prelude::*;
use serde_json::Value;
use servobee::record::inspect::{Inspection, Proposal, inspect};
use servobee::record::{Mapping, Record};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data");

fn file(name: &str, text: &str) -> (TempDir, PathBuf) {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, text).unwrap();
    (folder, path)
}

/// What is proposed, after it was read with: it gives a record to identify from, and the call says it.
fn working_maps(path: &Path) -> Vec<String> {
    let Inspection {
        proposals,
        problem,
        problem_left,
        call,
        ..
    } = inspect(path, &[]).unwrap();
    assert!(
        problem.is_some() && problem_left.is_none(),
        "{problem:?}, {problem_left:?}"
    );
    let texts: Vec<String> = proposals.into_iter().map(|proposal| proposal.map).collect();
    let maps: Vec<Mapping> = texts.iter().map(|map| map.parse().unwrap()).collect();
    let record = Record::read(path, &maps).unwrap();
    record.check_excited().unwrap();
    record.check_response().unwrap();
    for map in &texts {
        assert!(
            call.contains(&format!("--map \"{map}\"")),
            "{map:?} is not in {call:?}"
        );
    }
    texts
}

#[test]
fn measured_files_get_mappings_that_work() {
    for (name, expected) in [
        (
            "mts_actuator_mrdamper_0A.csv",
            [
                "t_s=time [s]",
                "x_cmd_mm=command [mm]",
                "x_meas_mm=spool [mm]",
            ],
        ),
        (
            "mts_actuator_mrdamper_1A.csv",
            [
                "t_s=time [s]",
                "x_cmd_mm=command [mm]",
                "x_meas_mm=spool [mm]",
            ],
        ),
    ] {
        if let Some(path) = measured(name) {
            assert_eq!(working_maps(&path), expected, "{name}");
        }
    }
}

#[test]
fn what_counts_rows_is_no_time_unless_the_file_says_how_far_they_are_apart() {
    let asked = |inspection: &Inspection, name: &str| {
        let asks = format!("\"{name}\" counts: say how far rows are apart");
        let timed = |map: &str| map.contains("=time");
        inspection.warnings.iter().any(|said| said.contains(&asks))
            && !inspection.proposals.iter().any(|one| timed(&one.map))
            && inspection.problem_left.is_some()
    };
    if let Some(path) = measured("sjoberg_hydraulic_actuator.csv") {
        let inspection = inspect(path, &[]).unwrap();
        assert!(asked(&inspection, "k"), "{inspection:?}");
    }
    let mut text = String::from(
        "Ventil 12\nAbtastrate = 2000 Hz\nNr\tSollwert [mA]\tLage [mA]\tTemperatur [°C]\n",
    );
    for row in 0..3000 {
        let command = |row: f64| 12.0 + 7.0 * (row * 0.013).sin();
        let (now, late) = (command(f64::from(row)), command(f64::from(row) - 9.0));
        text += &format!("{row}\t{now:.4}\t{late:.4}\t41,0\n").replace('.', ",");
    }
    let unsaid = Inspection::parse("a.csv", text.replace("2000 Hz", "fein"), &[]).unwrap();
    assert!(asked(&unsaid, "Nr"), "{unsaid:?}");
    let said = Inspection::parse("a.csv", &text, &[]).unwrap();
    assert!(
        said.problem.is_some() && said.problem_left.is_none(),
        "{said:?}"
    );
    let line = "\"Abtastrate = 2000 Hz\", says how far rows are apart";
    assert!(
        said.warnings.iter().any(|one| one.contains(line)),
        "{said:?}"
    );
    let call = "servobee identify a.csv --map \"Sollwert=command [%] *12.5 -150\" --map \"Lage=spool [%] *12.5 -150\" --map \
                \"Temperatur=temperature [degC]\" --sample-interval 0.0005";
    assert_eq!(said.call, call);
    assert!((said.timing.unwrap().rate() - 2000.0).abs() < 1e-6);
    // A unit of time at the end of its name makes a counter a clock.
    let clock = text
        .replace("Nr\t", "cycle_ms\t")
        .replace("2000 Hz", "fein");
    let clock = Inspection::parse("a.csv", clock, &[]).unwrap();
    assert!(
        clock.problem_left.is_none() && clock.call.contains("cycle_ms=time [ms]"),
        "{clock:?}"
    );
    // A column that is the command by its name has its null at 12 mA as well.
    let named = text.replace("Sollwert [mA]", "command [mA]");
    let named = Inspection::parse("a.csv", named, &[]).unwrap();
    let live = "command=command [%] *12.5 -150";
    assert!(
        named.problem_left.is_none() && named.call.contains(live),
        "{named:?}"
    );
}

/// What a logger might write: lines above the header, units in a row, decimal commas, and much that is wrong.
fn log() -> String {
    let mut text = String::from(
        "Channel file v2\nOperator: Ada\n\nZeit;x Soll;x Ist;p_A;Bemerkung\n[s];[mm];[mm];[bar];\n",
    );
    let command = |row: usize| 12.0 * (row as f64 * 0.013).sin() * (1.0 + (row / 200) as f64 / 9.0);
    for row in (0..2000_usize).filter(|row| !(700..704).contains(row)) {
        let late = command(row.saturating_sub(9)).min(14.0);
        let pressure = if row == 50 {
            String::new()
        } else {
            format!("{}", 80 + row % 7)
        };
        let note = if row == 3 { "los" } else { "" };
        let line = format!(
            "{:.3};{:.3};{:.2};{pressure};{note}\n",
            row as f64 * 0.002,
            command(row),
            (late / 0.05).round() * 0.05
        );
        text += &line.replace('.', ",");
    }
    text
}

#[test]
fn a_log_is_understood_with_all_that_is_wrong_in_it() {
    let (_folder, path) = file("log.txt", &log());
    let found = inspect(&path, &[]).unwrap();
    assert_eq!(
        found.format.to_string(),
        "CSV, cells separated by semicolons, decimal commas, header in row 4, units in row 5"
    );
    let column = |name: &str| found.columns.iter().find(|c| c.name == name).unwrap();
    assert_eq!(column("Zeit").proposed.as_deref(), Some("time [s]"));
    assert_eq!(column("x Soll").proposed.as_deref(), Some("command [mm]"));
    assert_eq!(column("x Ist").proposed.as_deref(), Some("spool [mm]"));
    assert_eq!(column("p_A").proposed.as_deref(), Some("pressure_a [bar]"));
    assert_eq!(column("Bemerkung").proposed, None);
    let timing = found.timing.as_ref().unwrap();
    assert!((timing.rate() - 500.0).abs() < 1e-6, "{timing:?}");
    assert_eq!(
        (
            timing.gaps.len(),
            timing.gaps[0].after,
            timing.gaps[0].missing
        ),
        (1, 699, 4)
    );
    let spool = &column("x Ist").values;
    assert!((spool.step.unwrap() / 0.05 - 1.0).abs() < 1e-6, "{spool:?}");
    assert_eq!(spool.max, Some(14.0));
    assert!(
        spool.clipped[1].is_some() && spool.clipped[0].is_none(),
        "{spool:?}"
    );
    assert_eq!(
        (column("p_A").values.empty, column("Bemerkung").values.text),
        (1, 1)
    );
    assert_eq!(
        (column("p_A").values.min, column("p_A").values.max),
        (Some(80.0), Some(86.0))
    );
    let follows = found.follows["spool"];
    assert!(
        (8..=10).contains(&follows.rows) && follows.correlation > 0.98,
        "{follows:?}"
    );
    let warnings = found.warnings.join("; ");
    for part in [
        "row 56, column \"p_A\"",
        "\"x Ist\" stays at its largest",
        "1 gap in time, where 4 rows",
    ] {
        assert!(warnings.contains(part), "{part:?} is not in {warnings:?}");
    }
    // Even with the mappings the empty cell stands in the way.
    let left = found.problem_left.unwrap();
    assert!(
        left.contains("row 56, column \"p_A\": the cell is empty"),
        "{left}"
    );

    // Told what the columns are, and with the cell filled in, nothing stands in the way.
    let (_folder, path) = file("log.txt", &log().replace(";;\n", ";80;\n"));
    let maps = ["Zeit=time [s]", "x Soll=command [mm]", "x Ist=spool [mm]"];
    let maps: Vec<Mapping> = maps.iter().map(|map| map.parse().unwrap()).collect();
    let found = inspect(&path, &maps).unwrap();
    assert!(found.is_ready(), "{:?}", found.problem);
    assert_eq!(found.columns[1].taken_as.as_deref(), Some("command [mm]"));
}

#[test]
fn values_tell_where_names_do_not() {
    let signal = |row: usize| (0.02 * row as f64 * (1.0 + row as f64 / 900.0)).sin();
    let text = |late: usize| {
        let mut text = String::from("c1,c2,c3,c4\n");
        for row in 0..800 {
            let (now, then) = (signal(row + late), signal(row));
            // The second moves, too, but like nothing else.
            let other = ((row * row) % 1009) as f64;
            text += &format!("{then},{other},{},{now}\n", row as f64 * 0.01);
        }
        text
    };
    let (_folder, path) = file("a.csv", &text(7));
    assert_eq!(
        working_maps(&path),
        ["c3=time [s]", "c4=command [1]", "c1=spool [1]"]
    );
    let found = inspect(&path, &[]).unwrap();
    let reasons: Vec<&str> = found.proposals.iter().map(|p| p.reason.as_str()).collect();
    assert!(
        reasons[0].contains("the only column that rises"),
        "{reasons:?}"
    );
    assert!(
        reasons[1].contains("\"c1\" follows it 7 rows later"),
        "{reasons:?}"
    );
    assert!(
        reasons[2].contains("it follows \"c4\" 7 rows later"),
        "{reasons:?}"
    );

    let counts = text(7).replacen("c1", "c1 [counts]", 1);
    let (_folder, path) = file("a.csv", &counts);
    let found = inspect(&path, &[]).unwrap();
    let spool = &found.proposals[2];
    assert_eq!(spool.map, "c1=spool [1]");
    assert!(
        spool.reason.contains("the unit \"counts\" is not known"),
        "{}",
        spool.reason
    );

    // At the same time either can be the command: neither is proposed.
    let (_folder, path) = file("a.csv", &text(0));
    let found = inspect(&path, &[]).unwrap();
    assert_eq!(found.proposals.len(), 1, "{:?}", found.proposals);
    assert!(found.problem_left.unwrap().contains("\"command [V]\""));

    // Names that contradict the values are warned of.
    let swapped = text(7).replacen("c1,c2,c3,c4", "command [V],c2,time [s],spool [V]", 1);
    let (_folder, path) = file("a.csv", &swapped);
    let found = inspect(&path, &[]).unwrap();
    assert!(found.is_ready());
    let warnings = found.warnings.join("; ");
    assert!(
        warnings.contains("spool leads the command by 7 rows"),
        "{warnings}"
    );
}

/// A signal and the same a little later, in `rows` rows.
fn signals(rows: usize, late: usize) -> impl Iterator<Item = (f64, f64)> {
    let signal = |row: usize| (0.02 * row as f64 * (1.0 + row as f64 / 900.0)).sin();
    (0..rows).map(move |row| (signal(row + late), signal(row)))
}

/// Whole numbers that are far apart for s are ms, and nobody has to find that out from an hour that lasted seconds.
#[test]
fn whole_numbers_without_a_unit_are_not_taken_in_s_in_silence() {
    let text = |head: &str, step: usize| {
        let rows = signals(500, 3).enumerate();
        let rows = rows.map(|(row, (u, x))| format!("{},{u},{x}\n", row * step));
        format!("{head}\n{}", rows.collect::<String>())
    };
    // By its name it is time, in s by the contract: then it is told, by those who fit it, too.
    for (head, says) in [
        ("time,command [V],spool [V]", true),
        ("time [s],command [V],spool [V]", true),
        ("time [ms],command [V],spool [V]", false),
    ] {
        let (folder, path) = file("a.csv", &text(head, 1));
        let found = inspect(&path, &[]).unwrap();
        assert!(found.is_ready());
        let told = "samples are 1 s apart, 499 s in all: is time really in s, not in ms? --map \"time=time [ms]\" says so";
        let warned = found.warnings.iter().any(|warning| warning == told);
        assert_eq!(warned, says, "{head}: {:?}", found.warnings);
        let shown = printed(&servobee(folder.path(), &["inspect", "a.csv"]));
        assert_eq!(shown.contains(told), says, "{shown}");
        let record = Record::read(&path, &[]).unwrap();
        assert_eq!(record.warnings.iter().any(|w| w == told), says);
    }
    // By a name of somebody else it is proposed in ms.
    for (name, step) in [("t", 1), ("Zeit", 2), ("timestamp", 10)] {
        let (_folder, path) = file(
            "a.csv",
            &text(&format!("{name},u_cmd [V],x_meas [V]"), step),
        );
        let found = inspect(&path, &[]).unwrap();
        assert_eq!(found.proposals[0].map, format!("{name}=time [ms]"));
        let reason = &found.proposals[0].reason;
        let why = format!("[ms] is assumed: in s a row would come every {step} s");
        assert!(reason.contains(&why), "{reason}");
        let interval = found.timing.unwrap().interval;
        assert!((interval - 1e-3 * step as f64).abs() < 1e-12, "{interval}");
    }
}

#[test]
fn a_unit_is_read_where_it_stands_and_none_is_made_up_for_another() {
    let table = |flow: &str| {
        let rows = signals(500, 3).enumerate();
        let rows = rows.map(|(row, (u, x))| format!("{},{u},{}\n", 1e-3 * row as f64, 9.0 * x));
        format!(
            "Time (s),Valve Cmd (V),{flow}\n{}",
            rows.collect::<String>()
        )
    };
    for (flow, expected) in [
        ("Flow (GPM)", "gpm"),
        ("Flow Rate (GPM)", "gpm"),
        ("Q (gal/min)", "gpm"),
        ("flow [US gpm]", "gpm"),
        ("Flow (l/min)", "L/min"),
        ("Flow_GPM", "gpm"),
        ("Flow (GPM at 1000 psi)", "gpm"),
        ("Flow (GPM) mean", "gpm"),
    ] {
        let (_folder, path) = file("a.csv", &table(flow));
        let found = inspect(&path, &[]).unwrap();
        let column = &found.columns[2];
        let is = column.taken_as.as_ref().or(column.proposed.as_ref());
        let is = is.unwrap_or_else(|| panic!("{flow}: {:?}", found.warnings));
        assert_eq!(*is, format!("flow [{expected}]"), "{flow}");
        assert_eq!(found.problem_left, None, "{flow}");
        let assumed = |p: &Proposal| p.reason.contains("assumed");
        assert!(
            !found.proposals.iter().any(assumed),
            "{:?}",
            found.proposals
        );
    }
    // 20 % more than a US gallon, or something else: it is asked, not assumed.
    for flow in ["Flow (imp gal/min)", "Flow (counts)", "flow [scfm]"] {
        let (_folder, path) = file("a.csv", &table(flow));
        let found = inspect(&path, &[]).unwrap();
        assert_eq!(
            found.columns[2].proposed, None,
            "{flow}: {:?}",
            found.proposals
        );
        assert!(found.problem_left.is_some());
    }
    // A unit that is known is not called unknown, and one of another quantity is no time.
    let with_time = |head: &str| {
        let rows = signals(500, 3).enumerate();
        let rows = rows.map(|(row, (u, x))| format!("{},{u},{x}\n", 1e-3 * row as f64));
        format!("{head},command [V],spool [V]\n{}", rows.collect::<String>())
    };
    let (_folder, path) = file("a.csv", &with_time("stamp [s]"));
    let found = inspect(&path, &[]).unwrap();
    assert_eq!(found.proposals[0].map, "stamp=time [s]");
    assert_eq!(
        found.proposals[0].reason,
        "it is the only column that rises from row to row"
    );
    let (_folder, path) = file("a.csv", &with_time("ramp [mm]"));
    let found = inspect(&path, &[]).unwrap();
    assert!(found.proposals.is_empty(), "{:?}", found.proposals);
}

/// Headers as benches elsewhere write them, over a command, a response three rows later, and what says nothing.
#[test]
fn headers_of_other_benches_are_understood() {
    let content = |head: &str, step: f64, empty: bool| {
        let mut text = format!("{head}\n");
        for (row, (u, x)) in signals(500, 3).enumerate() {
            let response = match empty && row % 90 == 17 {
                true => String::new(),
                false => (9.0 * x).to_string(),
            };
            text += &format!("{},{},{response},21.4\n", step * row as f64, 9.0 * u);
        }
        text
    };
    for (head, expected) in [
        (
            "Tempo [ms],Comando [%],Cursore [%],Aria",
            [
                "Tempo=time [ms]",
                "Comando=command [%]",
                "Cursore=spool [%]",
            ],
        ),
        (
            "tempo_s,comando_V,portata_l_min,T_aria_C",
            [
                "tempo_s=time [s]",
                "comando_V=command [V]",
                "portata_l_min=flow [l/min]",
            ],
        ),
        (
            "Temps [ms],Consigne [%],Retour [%],T ambiante",
            [
                "Temps=time [ms]",
                "Consigne=command [%]",
                "Retour=spool [%]",
            ],
        ),
        (
            "t(s),consigne(V),debit(l/min),T_air(C)",
            ["t=time [s]", "consigne=command [V]", "debit=flow [l/min]"],
        ),
        (
            "Tiempo (s),Consigna (mA),Caudal (l/min),Marcha",
            [
                "Tiempo=time [s]",
                "Consigna=command [mA]",
                "Caudal=flow [l/min]",
            ],
        ),
        // A unit of a flow is none of a command, whatever follows it.
        (
            "t [s],Kanal 1 [%],Kanal 2 [l/min],Kanal 3",
            ["t=time [s]", "Kanal 1=command [%]", "Kanal 2=flow [l/min]"],
        ),
        // What a loop is closed around is in the unit of its command.
        (
            "Zeit [ms],Sollwert [V],Kolbenposition [V],Umgebung [°C]",
            [
                "Zeit=time [ms]",
                "Sollwert=command [V]",
                "Kolbenposition=spool [V]",
            ],
        ),
        (
            "Zeit_s,Sollstrom_mA,Kolbenweg_V,Status",
            [
                "Zeit_s=time [s]",
                "Sollstrom_mA=command [mA]",
                "Kolbenweg_V=spool [V]",
            ],
        ),
        // A symbol of a flow that is measured is no spool.
        (
            "t_s,U_soll,Q_ist,Freigabe",
            ["t_s=time [s]", "U_soll=command [1]", "Q_ist=flow [L/min]"],
        ),
        // The room is no oil.
        (
            "Zeit_us,Soll_%,Ist_%,Umgebungstemperatur [°C]",
            ["Zeit_us=time [us]", "Soll_%=command [%]", "Ist_%=spool [%]"],
        ),
    ] {
        for empty in [false, true] {
            let found = Inspection::parse("a.csv", content(head, 1.0, empty), &[]).unwrap();
            let maps: Vec<&str> = found.proposals.iter().map(|p| p.map.as_str()).collect();
            assert_eq!(maps, expected, "{head}, empty cells: {empty}");
        }
    }
    // What counts by more than one is no clock, and a line above the header is.
    let counted = content("counter,cmd [V],spool [V],flag", 3.0, false);
    let found =
        Inspection::parse("a.csv", format!("Sample rate = 800 Hz\n{counted}"), &[]).unwrap();
    assert!(
        found.call.ends_with("--sample-interval 0.00125"),
        "{found:?}"
    );
    let campionamento = format!("Frequenza campionamento;800 Hz\n{counted}");
    let found = Inspection::parse("a.csv", campionamento, &[]).unwrap();
    assert!(
        found.call.ends_with("--sample-interval 0.00125"),
        "{found:?}"
    );
    let found = Inspection::parse("a.csv", &counted, &[]).unwrap();
    let asks = "\"counter\" counts: say how far rows are apart, with --sample-interval SECONDS";
    assert!(found.warnings.iter().any(|said| said == asks), "{found:?}");
}

/// Two tests side by side in one file, of which one is shorter.
#[test]
fn columns_of_two_tests_are_not_proposed_as_one_record() {
    let mut text = String::from("t1 [s],u1 [V],t2 [s],u2 [V],x2 [mm]\n");
    let [first, second] = [300, 800].map(|rows| signals(rows, 4).collect::<Vec<_>>());
    for (row, (u, x)) in second.iter().enumerate() {
        let time = 1e-3 * row as f64;
        text += &match first.get(row) {
            Some((u1, _)) => format!("{time},{u1},{time},{u},{x}\n"),
            None => format!(",,{time},{u},{x}\n"),
        };
    }
    let (_folder, path) = file("two.csv", &text);
    let found = inspect(&path, &[]).unwrap();
    let columns: Vec<&str> = found.proposals.iter().map(|p| p.column.as_str()).collect();
    assert_eq!(columns, ["t2 [s]", "u2 [V]", "x2 [mm]"]);
    assert_eq!(found.problem_left, None);
    let warnings = found.warnings.join("; ");
    assert!(
        warnings.contains("nothing is proposed for \"t1 [s]\", \"u1 [V]\""),
        "{warnings}"
    );

    // The longer one has no response: the shorter one is the record, or what comes nearest to one.
    let mut text = String::from("t1 [s],u1 [V],t2 [s],u2 [V],x2 [mm]\n");
    for (row, (u1, _)) in second.iter().enumerate() {
        let time = 1e-3 * row as f64;
        text += &match first.get(row) {
            Some((u, x)) => format!("{time},{u1},{time},{u},{x}\n"),
            None => format!("{time},{u1},,,\n"),
        };
    }
    let (_folder, path) = file("two.csv", &text);
    let found = inspect(&path, &[]).unwrap();
    let columns: Vec<&str> = found.proposals.iter().map(|p| p.column.as_str()).collect();
    assert_eq!(columns, ["t2 [s]", "u2 [V]", "x2 [mm]"]);
}

#[test]
fn a_repeated_command_is_noticed() {
    let rows = (0..600).map(|row| {
        let command = [0.0, 3.0, -2.0, 5.0][row / 50 % 4];
        format!("{},{command},{command}\n", row as f64 * 0.01)
    });
    let text: String = std::iter::once("time [s],command [V],spool [V]\n".into())
        .chain(rows)
        .collect();
    let (_folder, path) = file("a.csv", &text);
    let period = inspect(&path, &[]).unwrap().command_period.unwrap();
    assert!((period - 2.0).abs() < 1e-9, "{period}");
    let bench = inspect(Path::new(DATA).join("bench.csv"), &[]).unwrap();
    assert_eq!(bench.command_period, None);
}

#[test]
fn the_command_line_shows_it_and_prints_json() {
    let folder = Path::new(DATA);
    let shown = printed(&servobee(
        folder,
        &["inspect", "bench.csv", "mat/simulink.mat"],
    ));
    for part in [
        "bench.csv: CSV, cells separated by commas, header in row 1",
        "5.999 s, a row every 1 ms (1000 Hz), without jitter",
        "Ready for identify:\n  servobee identify bench.csv\n",
        "mat/simulink.mat: MAT file, level 5",
        "Gap after sample 40 at 0.039 s: 5 missing",
        "out.blockName is no column: text",
        "Not ready for identify: mat/simulink.mat: has no column \"spool [%]\"",
        "servobee identify mat/simulink.mat --map \"signals(2)(1)=spool [1]\"",
    ] {
        assert!(shown.contains(part), "{part:?} is not in\n{shown}");
    }
    let map = "signals(2)(1)=spool [%]";
    let json = printed(&servobee(
        folder,
        &["inspect", "mat/simulink.mat", "--map", map, "--json"],
    ));
    let json: Value = serde_json::from_str(&json).unwrap();
    let file = &json[0];
    assert_eq!(file["schema"], "servobee/inspect/1");
    assert_eq!(file["format"], "mat");
    assert_eq!(file["problem"], Value::Null);
    assert_eq!(file["columns"][2]["taken_as"], "spool [%]");
    assert_eq!(file["timing"]["gaps"][0]["missing"], 5);
    assert_eq!(
        file["call"],
        format!("servobee identify mat/simulink.mat --map \"{map}\"")
    );

    let json = printed(&servobee(folder, &["inspect", "bench.csv", "--json"]));
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json[0]["delimiter"], ",");
    assert_eq!(json[0]["columns"][1]["taken_as"], "command [V]");

    for (name, part) in [
        ("absent.csv", "cannot be read"),
        ("mat/level4.mat", "save -v7"),
    ] {
        let line = refused(&servobee(folder, &["inspect", "bench.csv", name]));
        assert!(line.contains(name) && line.contains(part), "{line}");
    }
}

#[test]
fn what_no_record_can_be_read_from_is_still_shown() {
    for (text, part) in [
        (
            "time,command [V],spool [%]\n0,1,2\n0,2,3\n1,3,4\n",
            "does not rise",
        ),
        (
            "time,command [V],spool [%]\n0,a,2\n1,b,3\n",
            "\"a\" is not a number",
        ),
        ("time,command [V],spool [%]\n0,1,2\n1,1,3\n", "1 throughout"),
        (
            "time,command [counts],spool [%]\n0,1,2\n1,2,3\n",
            "\"counts\" is not known",
        ),
        (
            "time,command [V],command [V]\n0,1,2\n1,2,3\n",
            "second time",
        ),
        (
            "time,command [V],spool [%]\n0,NaN,2\n1,NaN,3\n",
            "\"NaN\" is not finite",
        ),
        ("time,command [V]\n0,1\n1,2\n", "no column \"spool [%]\""),
    ] {
        let (folder, path) = file("a.csv", text);
        let found = inspect(&path, &[]).unwrap();
        let problem = found.problem.unwrap();
        assert!(problem.contains(part), "{part:?} is not in {problem:?}");
        let shown = printed(&servobee(folder.path(), &["inspect", "a.csv"]));
        assert!(
            shown.contains("Not ready for identify: ") && shown.contains(part),
            "{shown}"
        );
    }
}

/// Text that is almost a file of measurements, with huge, odd and missing cells.
fn almost_a_record() -> impl Strategy<Value = String> {
    "(Log\n)?(t|time)[;,\t ]u_cmd[;,\t ](x|y) ?(mm)?\n(s;V;mm\n)?((-?[0-9]{1,2}|1e308|-1e308|NaN|)[;,\t .\n]{1,2}){0,60}"
}

proptest! {
    #[test]
    fn no_text_panics(text in prop_oneof![any::<String>(), almost_a_record()]) {
        let (_folder, path) = file("a.csv", &text);
        let _ = inspect(&path, &[]);
        let maps = ["t=time [s]".parse().unwrap(), "u_cmd=command [V]".parse().unwrap()];
        let _ = inspect(&path, &maps);
    }
}
