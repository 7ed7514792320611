//! The function for MATLAB, run in Octave.

use crate::program::{BENCH, bench, printed, servobee};
use std::fs::write;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

/// A folder with `servobee.m`, as the program writes it.
fn written() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let function = printed(&servobee(folder.path(), &["matlab"]));
    write(folder.path().join("servobee.m"), function).unwrap();
    folder
}

/// What Octave prints of a `script` that runs in `folder`; `None`, with a loud line, where there is no Octave.
fn octave(folder: &Path, script: &str) -> Option<String> {
    let program = assert_cmd::cargo::cargo_bin("servobee");
    let begin = format!("program = '{}'; bench = '{BENCH}';\n", program.display());
    write(folder.join("run_it.m"), begin + script).unwrap();
    let ran = Command::new("octave-cli")
        .current_dir(folder)
        .args(["--norc", "--quiet", "run_it.m"])
        .output();
    let Ok(ran) = ran else {
        println!("SKIPPED: there is no octave-cli: the function for MATLAB was not run");
        return None;
    };
    let errors = String::from_utf8_lossy(&ran.stderr).into_owned();
    println!("{errors}");
    Some(String::from_utf8(ran.stdout).unwrap())
}

#[test]
fn octave_takes_files_matrices_and_structs_and_returns_the_report() {
    let folder = written();
    let script = "
        given = {'program', program, 'evaluator', 'cpu', 'effects', 'delay,null_bias'};
        of_file = servobee(bench, given{:});
        printf('%s %s\\n', of_file.verdict, of_file.effects(1).name);
        values = dlmread(bench, ',', 1, 0);
        names = {'time [s]', 'command [V]', 'spool [V]', 'flow [L/min]'};
        of_matrix = servobee(values, 'columns', names, 'out', 'result', given{:});
        printf('%d %d %d\\n', isequal(of_matrix.parameters, of_file.parameters), ...
          numel(of_matrix.residual.time) == rows(values), exist('result/report.html', 'file'));
        gone = of_matrix.residual.spool_measured - of_matrix.residual.spool_after;
        held = strcmp(of_matrix.residual.part, 'hold_out');
        printf('%d\\n', abs(sqrt(mean(gone(held) .^ 2)) / of_matrix.error.after.hold_out.spool.rmse - 1) < 1e-9);
        columns = struct('t', values(:, 1), 'u', values(:, 2), 'x', values(:, 3));
        of_struct = servobee(columns, 'map', {'t=time [s]', 'u=command [V]', 'x=spool [V]'}, ...
          'program', program, 'evaluator', 'cpu', 'effects', 'none');
        printf('%s %d\\n', of_struct.verdict, isempty(of_struct.folder));
    ";
    if let Some(said) = octave(folder.path(), script) {
        assert_eq!(said, "found delay\n1 1 2\n1\nnot_diagnosed 1\n");
    }
}

#[test]
fn octave_raises_what_the_program_refuses() {
    let folder = written();
    let script = "
        calls = {{bench, 'effects', 'dealy'}, {'nothing.csv'}, {zeros(9, 2), 'columns', {'time [s]'}}, ...
          {struct('a', 1:3, 'b', 1:4)}, {@sin}, {bench, 'effects'}};
        for k = 1:numel(calls)
          try
            servobee(calls{k}{:}, 'program', program);
            printf('nothing\\n');
          catch problem
            printf('%s: %s\\n', problem.identifier, problem.message);
          end
        end
    ";
    let Some(said) = octave(folder.path(), script) else {
        return;
    };
    let words = [
        "there is no effect \"dealy\"",
        "nothing.csv",
        "1 names for 2 columns",
        "b: has 4 values, and a has 3",
        "is a function_handle",
        "one has no value",
    ];
    assert_eq!(said.lines().count(), words.len(), "{said}");
    for (line, words) in said.lines().zip(words) {
        assert!(
            line.starts_with("servobee:input: ") && line.contains(words),
            "{line}"
        );
    }
}

#[test]
fn octave_reads_the_script_for_simscape() {
    let folder = bench();
    let identify = [
        "identify",
        "bench.csv",
        "--effects",
        "delay",
        "--out",
        "out",
    ];
    printed(&servobee(folder.path(), &identify));
    let export = ["export", "out/model.toml", "--out", "valve.m"];
    printed(&servobee(folder.path(), &export));
    write(folder.path().join("broken.m"), "x = (1;\n").unwrap();
    let script = "
        files = {'broken.m', 'valve.m'};
        for k = 1:2
          try
            __parse_file__(files{k});
            printf('read\\n');
          catch
            printf('not read\\n');
          end
        end
    ";
    if let Some(said) = octave(folder.path(), script) {
        assert_eq!(said, "not read\nread\n");
    }
}
