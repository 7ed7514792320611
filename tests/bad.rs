//! Bad files: each is refused with exit code 2 and one line that says where and what to do, without output, quickly and in
//! little memory.
//!
//! `data/bad` holds small ones, each bad for the reason that is its name, some of them found by the fuzz targets. In
//! `data/bad/expected.txt` a line has a call, the place that its error names, and words of what the error says; a tab parts
//! them. What is too large to keep is made here; the largest only with `SERVOBEE_HUGE=1`.

#![allow(
    unsafe_code,
    reason = "what one call took of memory is told by wait4 alone"
)]
#![cfg(target_os = "linux")]

use crate::program::names;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::mem::MaybeUninit;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::{scope, sleep};
use std::time::{Duration, Instant};
use tempfile::{TempDir, tempdir};

/// What refusing a file may take.
const MEMORY: u64 = 500_000_000;
const TIME: Duration = Duration::from_secs(10);

/// A message is no longer, in bytes.
const LONGEST: usize = 1500;

/// What a call did and took.
struct Ran {
    code: Option<i32>,
    printed: String,
    errors: String,
    time: Duration,
    /// Most bytes that were in memory at a time.
    memory: u64,
}

/// Runs the program in `folder`. It is ended if it takes far too long.
fn run(folder: &Path, arguments: &[String]) -> Ran {
    let streams = tempdir().unwrap();
    let [printed, errors] = ["printed", "errors"].map(|name| streams.path().join(name));
    let started = Instant::now();
    #[allow(
        clippy::zombie_processes,
        reason = "wait4 waits for it, and tells what it took"
    )]
    let child = Command::new(assert_cmd::cargo::cargo_bin!("servobee"))
        .current_dir(folder)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(File::create(&printed).unwrap())
        .stderr(File::create(&errors).unwrap())
        .spawn()
        .unwrap();
    let id = child.id() as libc::pid_t;
    let mut status = 0;
    let mut usage = MaybeUninit::<libc::rusage>::zeroed();
    loop {
        // SAFETY: both point to places of their types, and the process is our own that nobody else waits for.
        let ended = unsafe { libc::wait4(id, &mut status, libc::WNOHANG, usage.as_mut_ptr()) };
        assert!(ended >= 0, "{}", std::io::Error::last_os_error());
        if ended == id {
            break;
        }
        if started.elapsed() > 6 * TIME {
            // SAFETY: the process was not waited for yet, so that its number is still its own.
            unsafe { libc::kill(id, libc::SIGKILL) };
        }
        sleep(Duration::from_millis(2));
    }
    // SAFETY: plain numbers, and wait4 has filled them.
    let usage = unsafe { usage.assume_init() };
    Ran {
        code: libc::WIFEXITED(status).then(|| libc::WEXITSTATUS(status)),
        printed: fs::read_to_string(printed).unwrap(),
        errors: fs::read_to_string(errors).unwrap(),
        time: started.elapsed(),
        memory: 1024 * usage.ru_maxrss as u64,
    }
}

/// What is wrong with how `call` was refused in `folder`, where it must leave nothing; the error must begin with `place`
/// and hold `words`.
fn faults(folder: &Path, call: &[String], place: &str, words: &str) -> Vec<String> {
    let before = names(folder);
    let ran = run(folder, call);
    if ran.memory > MEMORY / 10 {
        let memory = ran.memory / 1_000_000;
        println!("{memory} MB, {:.2?}: {}", ran.time, call.join(" "));
    }
    let message = ran.errors.strip_prefix("servobee: ").unwrap_or_default();
    let located = message
        .strip_prefix(place)
        .and_then(|rest| rest.strip_prefix(": "));
    let parts = located.and_then(|rest| rest.split_once("; "));
    let wrong = [
        (ran.code != Some(2), format!("exit code {:?}", ran.code)),
        (
            !ran.printed.is_empty(),
            format!("printed {:?}", ran.printed),
        ),
        (ran.errors.lines().count() != 1, "not one line".into()),
        (ran.errors.len() > LONGEST, "a long message".into()),
        (
            ran.errors.trim_end().contains(char::is_control),
            "a control character".into(),
        ),
        (located.is_none(), format!("not at {place:?}")),
        (
            parts.is_none_or(|(problem, _)| !problem.contains(words)),
            format!("does not say {words:?}"),
        ),
        (
            parts.is_none_or(|(_, remedy)| remedy.trim().is_empty()),
            "no remedy".into(),
        ),
        (names(folder) != before, "a file is left".into()),
        (ran.time > TIME, format!("took {:?}", ran.time)),
        (
            ran.memory > MEMORY,
            format!("{} MB", ran.memory / 1_000_000),
        ),
    ];
    let wrong: Vec<String> = wrong
        .into_iter()
        .filter(|(is, _)| *is)
        .map(|(_, what)| what)
        .collect();
    match wrong.is_empty() {
        true => Vec::new(),
        false => vec![format!(
            "{}: {}\n    {}",
            call.join(" "),
            wrong.join(", "),
            ran.errors.trim_end()
        )],
    }
}

/// The words of a call; those in quotes stay together. Where a command takes `--out`, it gets one.
fn words(call: &str) -> Vec<String> {
    let parts = call.split('"').enumerate();
    let words = parts.flat_map(|(index, part)| match index % 2 {
        0 => part.split_whitespace().map(str::to_owned).collect(),
        _ => vec![part.to_owned()],
    });
    let mut words: Vec<String> = words.collect();
    let out = match words[0].as_str() {
        "inspect" => return words,
        "simulate" => "result.csv",
        "export" => "result.c",
        _ => "result",
    };
    words.extend(["--out", out].map(String::from));
    words
}

fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/bad")
}

#[test]
fn every_bad_file_is_refused_where_it_is_bad() {
    let expected = fs::read_to_string(corpus().join("expected.txt")).unwrap();
    let cases: Vec<[&str; 3]> = expected
        .lines()
        .map(|line| {
            let mut parts = line.split('\t');
            [(); 3].map(|()| {
                parts
                    .next()
                    .unwrap_or_else(|| panic!("three parts in {line:?}"))
            })
        })
        .collect();

    let called: BTreeSet<String> = cases.iter().flat_map(|[call, ..]| words(call)).collect();
    let files = names(&corpus());
    let bad = |name: &&String| !["good", "expected.txt"].contains(&name.as_str());
    let idle: Vec<&String> = files
        .iter()
        .filter(bad)
        .filter(|name| !called.contains(*name))
        .collect();
    assert!(idle.is_empty(), "in no call: {idle:?}");
    assert!(files.iter().filter(bad).count() >= 200);

    // Two at a time, each in a folder of its own with all the files, of which none may change or come in addition.
    let half = cases.len().div_ceil(2);
    let faults: Vec<String> = scope(|scope| {
        let workers: Vec<_> = cases
            .chunks(half)
            .map(|cases| {
                scope.spawn(|| {
                    let folder = copied();
                    let of = |[call, place, says]: &[&str; 3]| {
                        faults(folder.path(), &words(call), place, says)
                    };
                    cases.iter().flat_map(of).collect::<Vec<String>>()
                })
            })
            .collect();
        workers
            .into_iter()
            .flat_map(|worker| worker.join().unwrap())
            .collect()
    });
    assert!(
        faults.is_empty(),
        "{} of {}:\n{}",
        faults.len(),
        cases.len(),
        faults.join("\n")
    );
    println!(
        "{} calls with {} bad files",
        cases.len(),
        files.iter().filter(bad).count()
    );
}

/// A folder with all that is in `data/bad`.
fn copied() -> TempDir {
    let folder = tempdir().unwrap();
    fs::create_dir(folder.path().join("good")).unwrap();
    for part in ["", "good"] {
        for name in names(&corpus().join(part)) {
            let from = corpus().join(part).join(&name);
            if from.is_file() {
                fs::copy(from, folder.path().join(part).join(&name)).unwrap();
            }
        }
    }
    folder
}

/// Writes a record or, with this ending, a model file with `write`, and refuses it.
#[track_caller]
fn assert_refused(
    name: &str,
    write: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
    place: &str,
    says: &str,
) {
    let folder = copied();
    let path = folder.path().join(name);
    let mut file = BufWriter::new(File::create(&path).unwrap());
    write(&mut file).and_then(|()| file.flush()).unwrap();
    let call = match name.ends_with(".toml") {
        true => format!("simulate {name} good/record.csv"),
        false => format!("identify {name}"),
    };
    let faults = faults(folder.path(), &words(&call), place, says);
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

const HEADER: &str = "time [s],command [V],spool [V]\n";

/// Rows of a record, of which the last has a word in it.
fn rows(file: &mut impl Write, rows: usize) -> std::io::Result<()> {
    file.write_all(HEADER.as_bytes())?;
    for row in 0..rows {
        writeln!(file, "{row},{},0.25", row % 2)?;
    }
    writeln!(file, "{rows},1,word")
}

#[test]
fn a_long_line_is_refused() {
    let long = |file: &mut BufWriter<File>| {
        file.write_all(HEADER.as_bytes())?;
        file.write_all(&[b'1'; 3 << 20])
    };
    assert_refused("long.csv", long, "long.csv, row 2", "longer than 1 MiB");
}

#[test]
fn a_line_of_many_cells_is_refused() {
    for (name, line) in [
        ("commas", "1,"),
        ("words", "a,"),
        ("all", "1,;|\t:"),
        ("blanks", "1 "),
    ] {
        let path = format!("{name}.csv");
        let wide = |file: &mut BufWriter<File>| {
            for _ in 0..8 {
                file.write_all(line.repeat((1 << 20) / line.len() - 1).as_bytes())?;
                file.write_all(b"\n")?;
            }
            Ok(())
        };
        let folder = copied();
        let mut file = BufWriter::new(File::create(folder.path().join(&path)).unwrap());
        wide(&mut file).and_then(|()| file.flush()).unwrap();
        let ran = run(folder.path(), &words(&format!("identify {path}")));
        assert_eq!(ran.code, Some(2), "{}", ran.errors);
        assert!(
            ran.errors
                .starts_with(&format!("servobee: {path}, row 1: ")),
            "{}",
            ran.errors
        );
        assert!(
            ran.time < TIME && ran.memory < MEMORY,
            "{name}: {:?}, {}",
            ran.time,
            ran.memory
        );
    }
}

#[test]
fn a_fault_behind_many_rows_is_found() {
    let many = |file: &mut BufWriter<File>| rows(file, 300_000);
    assert_refused(
        "rows.csv",
        many,
        "rows.csv, row 300002, column \"spool [V]\"",
        "\"word\"",
    );
}

#[test]
fn more_cells_than_a_record_can_have_are_refused() {
    // Numbers, texts and nothing: two bytes each, so that the file is far smaller than what it would become.
    for (cell, rows, last) in [("1,", 2000, 1679), ("a,", 1000, 341), (",", 1000, 341)] {
        let cells = |file: &mut BufWriter<File>| {
            let names: Vec<String> = (0..9_999).map(|column| format!("x{column}")).collect();
            writeln!(file, "{}", names.join(","))?;
            for row in 0..rows {
                let cell = if row == 0 { "1," } else { cell };
                writeln!(file, "{}5", cell.repeat(9_998))?;
            }
            Ok(())
        };
        let place = format!("cells.csv, row {last}");
        assert_refused("cells.csv", cells, &place, "beyond 16 million cells");
    }
}

#[test]
fn a_deep_model_file_is_refused() {
    for (open, close) in [("[", "]"), ("{a=", "}")] {
        for depth in [200, 100_000] {
            let deep = format!("a = {}1{}\n", open.repeat(depth), close.repeat(depth));
            let write = |file: &mut BufWriter<File>| file.write_all(deep.as_bytes());
            let place = format!("deep.toml, line 1, {:?}...", &deep[..40]);
            assert_refused("deep.toml", write, &place, "recur");
        }
    }
    let dotted = format!("{}a = 1\n", "a.".repeat(200_000));
    let write = |file: &mut BufWriter<File>| file.write_all(dotted.as_bytes());
    let place = format!("deep.toml, line 1, {:?}...", &dotted[..40]);
    assert_refused("deep.toml", write, &place, "recur");
}

#[test]
fn a_long_model_file_is_refused() {
    let long =
        |file: &mut BufWriter<File>| file.write_all("# nothing\n".repeat(200_000).as_bytes());
    assert_refused("long.toml", long, "long.toml", "longer than 1 MiB");
    let many = |file: &mut BufWriter<File>| {
        let model = fs::read_to_string(corpus().join("good/model.toml"))?;
        write!(
            file,
            "{model}{}",
            "[[parameter]]\nname = \"gain\"\n".repeat(30_000)
        )
    };
    let place = "long.toml, line 8, \"name = \\\"gain\\\"\"";
    assert_refused("long.toml", many, place, "above already");
}

/// The header of a MAT file, and a variable that is an element of `kind` with `content`.
fn mat(kind: u32, content: &[u8]) -> Vec<u8> {
    let mut bytes = b"MATLAB 5.0 MAT-file, made by a test".to_vec();
    bytes.resize(124, b' ');
    bytes.extend([0, 1, b'I', b'M']);
    bytes.extend(element(kind, content));
    bytes
}

fn element(kind: u32, content: &[u8]) -> Vec<u8> {
    let mut bytes = kind.to_le_bytes().to_vec();
    bytes.extend((content.len() as u32).to_le_bytes());
    bytes.extend(content);
    if kind != 15 {
        bytes.resize(bytes.len().next_multiple_of(8), 0);
    }
    bytes
}

/// The beginning of an array of class `class` with so many rows that is called `name`.
fn array(class: u32, rows: i32, name: &str) -> Vec<u8> {
    let flags = [class.to_le_bytes(), [0; 4]].concat();
    let size = [rows.to_le_bytes(), 1_i32.to_le_bytes()].concat();
    [
        element(6, &flags),
        element(5, &size),
        element(1, name.as_bytes()),
    ]
    .concat()
}

/// An array that inflates to `begin` and so many zeros.
fn bomb(begin: &[u8], zeros: usize, announced: usize) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(&14_u32.to_le_bytes()).unwrap();
    encoder
        .write_all(&(announced as u32).to_le_bytes())
        .unwrap();
    encoder.write_all(begin).unwrap();
    let nothing = vec![0; 1 << 20];
    for part in (0..zeros).step_by(nothing.len()) {
        encoder
            .write_all(&nothing[..nothing.len().min(zeros - part)])
            .unwrap();
    }
    encoder.finish().unwrap()
}

#[test]
fn announced_rows_that_are_not_there_are_refused() {
    let rows = |file: &mut BufWriter<File>| {
        let values = element(9, &1_f64.to_le_bytes());
        file.write_all(&mat(
            14,
            &[array(6, 1_000_000_000, "time"), values].concat(),
        ))
    };
    let place = "rows.mat, variable \"time\"";
    assert_refused("rows.mat", rows, place, "not as many numbers");
    for (class, place) in [
        (1, "rows.mat, variable \"a.{1}\""),
        (2, "rows.mat, variable \"a\""),
    ] {
        let cells =
            |file: &mut BufWriter<File>| file.write_all(&mat(14, &array(class, i32::MAX, "a")));
        assert_refused("rows.mat", cells, place, "ends before");
    }
}

#[test]
fn a_bomb_of_zeros_is_refused() {
    let zeros: usize = 400 << 20;
    let begin = array(6, (zeros / 8) as i32, "time");
    let tag = [9_u32.to_le_bytes(), (zeros as u32).to_le_bytes()].concat();
    let begin = [begin, tag].concat();
    let announced = begin.len() + zeros;
    for (announced, place, says) in [
        (announced, "bomb.mat", "over 256 MiB"),
        (200 << 20, "bomb.mat", "not as long as it says"),
        (1000, "bomb.mat", "not as long as it says"),
    ] {
        let content = bomb(&begin, zeros, announced);
        assert!(content.len() < 1 << 20);
        let write = |file: &mut BufWriter<File>| file.write_all(&mat(15, &content));
        assert_refused("bomb.mat", write, place, says);
    }
    // Bytes that become doubles, many variables, and many fields without a name.
    let zeros: usize = 100 << 20;
    let tag = [2_u32.to_le_bytes(), (zeros as u32).to_le_bytes()].concat();
    let begin = [array(6, zeros as i32, "time"), tag].concat();
    let content = bomb(&begin, zeros, begin.len() + zeros);
    let write = |file: &mut BufWriter<File>| file.write_all(&mat(15, &content));
    assert_refused(
        "bomb.mat",
        write,
        "bomb.mat, variable \"time\"",
        "over 256 MiB",
    );

    let rows: usize = 4 << 20;
    let tag = [9_u32.to_le_bytes(), (8 * rows as u32).to_le_bytes()].concat();
    let begin = [array(6, rows as i32, "x"), tag].concat();
    let content = bomb(&begin, 8 * rows, begin.len() + 8 * rows);
    let write = |file: &mut BufWriter<File>| {
        file.write_all(&mat(15, &content))?;
        (0..100).try_for_each(|_| file.write_all(&element(15, &content)))
    };
    assert_refused(
        "bomb.mat",
        write,
        "bomb.mat, variable \"x\"",
        "over 256 MiB",
    );

    let length = element(5, &1_i32.to_le_bytes());
    let tag = [1_u32.to_le_bytes(), (zeros as u32).to_le_bytes()].concat();
    let begin = [array(2, 1, "s"), length, tag].concat();
    let content = bomb(&begin, zeros, begin.len() + zeros);
    let write = |file: &mut BufWriter<File>| file.write_all(&mat(15, &content));
    assert_refused(
        "bomb.mat",
        write,
        "bomb.mat, variable \"s\"",
        "over 256 MiB",
    );
}

#[test]
fn a_bomb_of_nan_is_refused() {
    let nan = |file: &mut BufWriter<File>| {
        file.write_all(HEADER.as_bytes())?;
        (0..500_000).try_for_each(|_| file.write_all(b"NaN,NaN,NaN\n"))
    };
    let place = "nan.csv, row 2, column \"time [s]\"";
    assert_refused("nan.csv", nan, place, "not finite");
}

#[test]
fn what_has_no_end_is_not_read_to_it() {
    for (call, says) in [
        ("identify /dev/zero", "longer than 256 MiB"),
        ("simulate /dev/zero good/record.csv", "longer than 1 MiB"),
        ("datasheet --flow /dev/zero", "longer than 256 MiB"),
    ] {
        let faults = faults(copied().path(), &words(call), "/dev/zero", says);
        assert!(faults.is_empty(), "{}", faults.join("\n"));
    }
}

/// Whether the files of a gigabyte and more are wanted.
fn huge() -> bool {
    let wanted = std::env::var_os("SERVOBEE_HUGE").is_some_and(|value| value == "1");
    if !wanted {
        println!("NOT TESTED: bad files of a gigabyte; SERVOBEE_HUGE=1 tests them");
    }
    wanted
}

#[test]
fn a_gigabyte_is_refused() {
    if !huge() {
        return;
    }
    // One line, zeros that take no room on the disk, and rows of which the last is bad.
    let line = |file: &mut BufWriter<File>| {
        file.write_all(HEADER.as_bytes())?;
        (0..1 << 10).try_for_each(|_| file.write_all(&[b'1'; 1 << 20]))
    };
    assert_refused("big.csv", line, "big.csv", "longer than 256 MiB");
    let hole = |file: &mut BufWriter<File>| {
        file.write_all(&mat(14, b""))?;
        file.seek(SeekFrom::Start(3 << 30))?;
        file.write_all(b"0")
    };
    assert_refused("big.mat", hole, "big.mat", "longer than 256 MiB");
    let hole = |file: &mut BufWriter<File>| {
        file.seek(SeekFrom::Start(1 << 30))?;
        file.write_all(b"0")
    };
    assert_refused("big.toml", hole, "big.toml", "longer than 1 MiB");
    let many = |file: &mut BufWriter<File>| rows(file, 60_000_000);
    assert_refused("big.csv", many, "big.csv", "longer than 256 MiB");
}

#[test]
fn the_largest_files_that_are_read_are_refused_in_bounds() {
    if !huge() {
        return;
    }
    // As many cells as there may be, all numbers; one more; nothing but texts; one line below the limit of the file.
    let most = (1 << 22) - 2;
    let place = format!("big.csv, row {}, column \"spool [V]\"", most + 2);
    let many = |file: &mut BufWriter<File>| rows(file, most);
    assert_refused("big.csv", many, &place, "\"word\"");
    let many = |file: &mut BufWriter<File>| rows(file, 12_000_000);
    let place = format!("big.csv, row {}", most + 4);
    assert_refused("big.csv", many, &place, "beyond 16 million cells");
    let digits = "0.123456789012345678";
    let wide = |file: &mut BufWriter<File>| {
        file.write_all(HEADER.as_bytes())?;
        (0..4_100_000)
            .try_for_each(|row| writeln!(file, "{row}.000000000000,{digits},{digits}"))?;
        writeln!(file, "9999999,1,word")
    };
    let place = "big.csv, row 4100002, column \"spool [V]\"";
    assert_refused("big.csv", wide, place, "\"word\"");
    let line = |file: &mut BufWriter<File>| {
        file.write_all(HEADER.as_bytes())?;
        (0..255).try_for_each(|_| file.write_all(&[b'1'; 1 << 20]))
    };
    assert_refused("big.csv", line, "big.csv, row 2", "longer than 1 MiB");
    let foreign =
        |file: &mut BufWriter<File>| (0..255).try_for_each(|_| file.write_all(&[0xe4; 1 << 20]));
    assert_refused("big.csv", foreign, "big.csv", "longer than 64 MiB");
    let doubles = |file: &mut BufWriter<File>| {
        let bytes: u32 = 255 << 20;
        let tag = [9_u32.to_le_bytes(), bytes.to_le_bytes()].concat();
        let begin = [array(6, (bytes / 8) as i32, "time"), tag].concat();
        let mut start = mat(14, &[]);
        let at = start.len() - 4;
        start[at..].copy_from_slice(&(begin.len() as u32 + bytes).to_le_bytes());
        file.write_all(&start)?;
        file.write_all(&begin)?;
        (0..255).try_for_each(|_| file.write_all(&[0x3f; 1 << 20]))
    };
    let place = "big.mat, variable \"time\"";
    assert_refused("big.mat", doubles, place, "over 256 MiB");
}
