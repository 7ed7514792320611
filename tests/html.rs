//! `report.html`: what is in it, and what a browser makes of it.

use crate::browser;
use crate::browser::{Browser, Shown};
use crate::program::{BENCH, printed, servobee, servobee_with};
use std::fs::{create_dir, read_to_string, write};
use std::panic::catch_unwind;
use std::path::Path;
use tempfile::TempDir;

/// Records, and what a call of `identify` says of them.
struct Case {
    name: &'static str,
    synthesize: &'static [&'static str],
    identify: &'static [&'static str],
    /// What the first heading says.
    answer: &'static str,
    /// Figures that only this case has.
    figures: &'static [&'static str],
}

const CASES: [Case; 3] = [
    Case {
        name: "found",
        synthesize: &["--effect", "delay=0.004,null_bias=0.3", "--seconds", "4"],
        identify: &["--effects", "delay,null_bias"],
        answer: "The valve answers as if 0.299 V were added to the command (null bias) and the response lags by 4 ms more than the model allows (delay).",
        figures: &["ranking-2", "time-flow", "residual-flow", "spectrum-flow"],
    },
    Case {
        name: "none",
        synthesize: &["--seconds", "4", "--no-flow"],
        identify: &["--effects", "delay,null_bias"],
        answer: "The base model lacks nothing that this record shows.",
        figures: &[],
    },
    Case {
        name: "unexplained",
        synthesize: &["--outsider", "detent=0.3", "--seconds", "4", "--no-flow"],
        identify: &["--effects", "delay,null_bias"],
        answer: "The base model lacks something that none of the 2 effects that were asked explains.",
        figures: &[],
    },
];

/// Figures of every page.
const FIGURES: [&str; 8] = [
    "time-spool",
    "residual-spool",
    "signature",
    "spectrum-spool",
    "ranking",
    "flow-curve",
    "bode",
    "convergence",
];

impl Case {
    /// Writes the page of this case into `folder`.
    fn page(&self, folder: &Path) -> String {
        let record = format!("{}.csv", self.name);
        let synthesize = [&["synthesize", "--out", &record], self.synthesize].concat();
        printed(&servobee(folder, &synthesize));
        let call = [&["identify", &record, "--out", self.name], self.identify].concat();
        printed(&servobee(folder, &call));
        read_to_string(folder.join(self.name).join("report.html")).unwrap()
    }

    fn expected(&self) -> impl Iterator<Item = &'static str> {
        FIGURES.into_iter().chain(self.figures.iter().copied())
    }
}

/// The text between `start` and `end`, wherever it is.
fn between<'t>(text: &'t str, start: &str, end: &str) -> Vec<&'t str> {
    let rest = text.split(start).skip(1);
    rest.map(|rest| rest.split(end).next().unwrap()).collect()
}

/// Every tag is closed by its own, in order.
pub(crate) fn assert_well_formed(page: &str) {
    const VOID: [&str; 2] = ["meta", "br"];
    let body = page
        .strip_prefix("<!DOCTYPE html>")
        .expect("a document type");
    let mut open: Vec<&str> = Vec::new();
    for tag in body.split('<').skip(1) {
        let (tag, text) = tag
            .split_once('>')
            .unwrap_or_else(|| panic!("<{tag} does not end"));
        let name = tag
            .trim_start_matches('/')
            .split(|c: char| c.is_whitespace() || c == '/')
            .next()
            .unwrap();
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "</{name}>");
        } else if !tag.ends_with('/') && !VOID.contains(&name) {
            open.push(name);
        }
        let style = open.last() == Some(&"style");
        let entities = text.split('&').skip(1);
        assert!(
            style
                || entities
                    .clone()
                    .all(|e| e.split(';').next().unwrap().len() < 7),
            "{text}"
        );
    }
    assert_eq!(open, Vec::<&str>::new());
}

#[test]
fn every_verdict_has_its_answer_and_every_figure() {
    let folder = TempDir::new().unwrap();
    for case in &CASES {
        let page = case.page(folder.path());
        assert_well_formed(&page);
        assert_eq!(
            between(&page, "<h1>", "</h1>"),
            [case.answer],
            "{}",
            case.name
        );
        for id in case.expected() {
            let figure = between(&page, &format!("<figure id=\"{id}\">"), "</figure>");
            assert_eq!(figure.len(), 1, "{}: figure {id}", case.name);
            let caption = between(figure[0], "<figcaption>", "</figcaption>");
            assert!(
                caption.len() == 1 && caption[0].len() > 40,
                "{}: {id}: {caption:?}",
                case.name
            );
            let plots = between(figure[0], "<svg role=\"img\" aria-label=\"", "</svg>");
            assert!(!plots.is_empty(), "{}: {id} has no plot", case.name);
            for plot in plots {
                assert!(
                    plot.matches("<text").count() > 4,
                    "{}: {id} has no ticks",
                    case.name
                );
                let marks =
                    ["<polyline", "<circle", "<rect"].map(|mark| plot.matches(mark).count());
                assert!(
                    marks.iter().sum::<usize>() > 3,
                    "{}: {id}: {marks:?}",
                    case.name
                );
            }
        }
        let card = between(&page, "<section id=\"card\">", "</section>");
        assert!(page.find("<section").unwrap() == page.find("<section id=\"card\"").unwrap());
        assert!(!card[0].contains(">0 … 0<"), "{}: {}", case.name, card[0]);
        let incomplete = card[0].contains("the model is incomplete");
        assert_eq!(incomplete, case.name == "unexplained");
        assert_eq!(
            card[0].contains("Rated flow at 10 bar: "),
            case.name == "found"
        );
        // The spool fails alone, and the flow is measured, too.
        let words = "only what acts there or at the sensor of the spool was looked for first";
        assert_eq!(page.contains(words), case.name == "found", "{}", case.name);
        for explained in [
            "The base model is ",
            "Held-out rows are ",
            "The promise of an effect is ",
        ] {
            assert!(page.contains(explained), "{}: {explained}", case.name);
        }
        for id in ["parameters", "card", "remaining", "run"] {
            assert_eq!(
                page.matches(&format!("<section id=\"{id}\">")).count(),
                1,
                "{}: {id}",
                case.name
            );
        }
        for value in ["NaN", "inf,", "inf\"", ">inf", ">null<", "None", "Some("] {
            assert!(!page.contains(value), "{}: {value}", case.name);
        }
        for outside in [
            "http:", "https:", "src=", "href=", "url(", "@import", "<script", "<link", "<img",
        ] {
            assert!(!page.contains(outside), "{}: {outside}", case.name);
        }
        assert!(
            page.len() < 1_000_000,
            "{}: {} bytes",
            case.name,
            page.len()
        );
    }
}

/// The page of the datasheet of a valve with two amplitudes.
pub(crate) fn assert_page_of_two_amplitudes(page: &str) {
    assert_well_formed(page);
    assert_eq!(
        between(page, "<h1>", "</h1>"),
        ["The model follows the phase to 2.9 deg RMS."]
    );
    for (id, plots) in [("curve-1", 2), ("convergence-1", 3)] {
        let figure = between(page, &format!("<figure id=\"{id}\">"), "</figure>");
        assert_eq!(figure.len(), 1, "{id}");
        assert_eq!(
            figure[0].matches("<svg role=\"img\"").count(),
            plots,
            "{id}"
        );
    }
    let Some(browser) = Browser::find() else {
        return;
    };
    let shown = browser.show(page, 1100, false);
    assert!(shown.complaints.is_empty(), "{:?}", shown.complaints);
    assert_eq!(shown.plots.len(), 5);
    for plot in &shown.plots {
        assert!(
            plot.outside.is_empty() && plot.overlaps.is_empty(),
            "{plot:?}"
        );
    }
    assert!(shown.content <= shown.window);
}

#[test]
fn a_hum_is_shown_over_its_period() {
    let folder = TempDir::new().unwrap();
    let hum = "periodic_disturbance.spool=0.1:frequency=50";
    let record = [
        "synthesize",
        "--command",
        "chirp",
        "--effect",
        hum,
        "--seconds",
        "4",
        "--no-flow",
        "--out",
        "hum.csv",
    ];
    printed(&servobee(folder.path(), &record));
    let call = [
        "identify",
        "hum.csv",
        "--effects",
        "periodic_disturbance",
        "--out",
        "out",
    ];
    printed(&servobee(folder.path(), &call));
    let page = read_to_string(folder.path().join("out/report.html")).unwrap();
    let signature = between(&page, "id=\"signature\"", "</figure>");
    assert!(
        signature[0].contains("phase of the oscillation [periods]"),
        "{signature:?}"
    );
}

#[test]
fn what_a_file_is_called_is_text_on_the_page() {
    let folder = TempDir::new().unwrap();
    let names = [
        "<script>alert(1)</script>.csv",
        "<img src=x onerror=alert(2)>&\".csv",
    ];
    create_dir(folder.path().join("<script>alert(1)<")).unwrap();
    let text = read_to_string(BENCH).unwrap();
    let mut lines = text.lines();
    let head = format!("{},<script>alert(3)</script>\n", lines.next().unwrap());
    let rows: String = lines.map(|line| format!("{line},1\n")).collect();
    for (i, name) in names.into_iter().enumerate() {
        write(folder.path().join(name), format!("{head}{rows}")).unwrap();
        let out = format!("out{i}");
        printed(&servobee(
            folder.path(),
            &["identify", name, "--effects", "none", "--out", &out],
        ));
        let page = read_to_string(folder.path().join(&out).join("report.html")).unwrap();
        assert_well_formed(&page);
        for raw in ["<script", "<img"] {
            assert!(!page.contains(raw), "{raw}");
        }
        let escaped = [
            "&lt;script&gt;alert(1)&lt;/script&gt;.csv",
            "&lt;img src=x onerror=alert(2)&gt;&amp;&quot;",
        ];
        assert!(page.contains(escaped[i]), "{}", escaped[i]);
        assert!(
            page.contains("&lt;script&gt;alert(3)"),
            "the column that is ignored"
        );
    }
}

#[test]
fn the_same_call_writes_the_same_page_and_a_long_record_a_small_one() {
    let folder = TempDir::new().unwrap();
    let make = [
        "synthesize",
        "--out",
        "long.csv",
        "--seconds",
        "60",
        "--no-flow",
        "--effect",
        "delay=0.003",
    ];
    printed(&servobee(folder.path(), &make));
    let run = |out: &str, threads: &str| {
        let call = [
            "identify",
            "long.csv",
            "--effects",
            "none",
            "--evaluator",
            "cpu",
            "--out",
            out,
        ];
        printed(&servobee_with(
            folder.path(),
            &call,
            &[("RAYON_NUM_THREADS", threads)],
        ));
        let page = read_to_string(folder.path().join(out).join("report.html")).unwrap();
        let time = between(&page, "<dt>Time</dt><dd>", "</dd>")[0].to_owned();
        assert!(time.ends_with(" s"), "{time}");
        page.replace(&format!("<dd>{time}</dd>"), "")
    };
    let first = run("first", "1");
    assert!(
        first.len() < 600_000,
        "{} bytes for 60 000 rows",
        first.len()
    );
    assert!(first == run("second", "2"), "two runs differ");
}

#[test]
fn a_browser_shows_every_plot_without_a_complaint() {
    let Some(browser) = Browser::find() else {
        return;
    };
    let folder = TempDir::new().unwrap();
    for case in &CASES {
        let page = case.page(folder.path());
        for (width, dark) in [(1100, false), (1100, true), (500, false)] {
            let place = format!("{}, {width} pixels wide, dark: {dark}", case.name);
            let shown = browser.show(&page, width, dark);
            assert!(
                shown.complaints.is_empty(),
                "{place}: {:?}",
                shown.complaints
            );
            assert_shown(&shown, case, &place);
            let [paper, ink] = [&shown.paper, &shown.ink].map(|colour| browser::luminance(colour));
            assert_eq!(
                paper < ink,
                dark,
                "{place}: {} on {}",
                shown.ink,
                shown.paper
            );
            for line in &shown.lines {
                let contrast = browser::contrast(line, &shown.paper);
                assert!(
                    contrast >= 3.0,
                    "{place}: a line of {line} on {}: {contrast:.2}",
                    shown.paper
                );
            }
        }
        let picture = browser.picture(&page, folder.path());
        assert!(
            picture > 50_000,
            "{}: a picture of {picture} bytes",
            case.name
        );
    }
}

fn assert_shown(shown: &Shown, case: &Case, place: &str) {
    for id in case.expected() {
        let boxes: Vec<_> = shown
            .plots
            .iter()
            .filter(|plot| plot.figure == id)
            .collect();
        assert!(!boxes.is_empty(), "{place}: {id} is not shown");
        for plot in boxes {
            assert!(
                plot.width > 200.0 && plot.height > 60.0,
                "{place}: {plot:?}"
            );
            assert!(
                plot.outside.is_empty(),
                "{place}: {id}: text is cut off: {:?}",
                plot.outside
            );
            assert!(
                plot.overlaps.is_empty(),
                "{place}: {id}: text lies on text: {:?}",
                plot.overlaps
            );
        }
    }
    assert!(
        shown.content <= shown.window,
        "{place}: {} pixels in a window of {}",
        shown.content,
        shown.window
    );
}

#[test]
fn the_browser_test_sees_what_is_wrong() {
    let Some(browser) = Browser::find() else {
        return;
    };
    let page = |body: &str| {
        format!(
            "<!DOCTYPE html><html><head><meta charset=\"utf-8\"></head><body>{body}</body></html>"
        )
    };
    let plot = |content: &str| {
        page(&format!(
            "<figure id=\"a\"><svg role=\"img\" viewBox=\"0 0 400 300\" width=\"400\">{content}</svg></figure>"
        ))
    };
    let complaint = browser
        .show(
            &page("<script>console.error('planted')</script>"),
            1100,
            false,
        )
        .complaints;
    assert!(
        complaint.iter().any(|line| line.contains("planted")),
        "{complaint:?}"
    );
    let wide = browser.show(&page("<div style=\"width:3000px\">wide</div>"), 1100, false);
    assert!(wide.content > wide.window);
    let cut = browser.show(
        &plot("<text x=\"380\" y=\"100\">a label that is too long</text>"),
        1100,
        false,
    );
    assert_eq!(cut.plots[0].outside.len(), 1, "{:?}", cut.plots);
    let on_top = browser.show(
        &plot("<text x=\"50\" y=\"100\">one label</text><text x=\"70\" y=\"103\">another</text>"),
        1100,
        false,
    );
    assert_eq!(on_top.plots[0].overlaps.len(), 1, "{:?}", on_top.plots);
    let long = page(&"<p style=\"height:900px\">a sheet</p>".repeat(3));
    assert_eq!(browser.sheets(&long), 3);
    let wide = "<style>@media print { p { width: 900px } }</style><p>wide on paper</p>";
    let refused = catch_unwind(|| browser.assert_prints(&page(wide), "planted"));
    let told = *refused.unwrap_err().downcast::<String>().unwrap();
    assert!(told.contains("planted: "), "{told}");
}

#[test]
fn measured_figures_stand_beside_those_of_the_model() {
    let folder = TempDir::new().unwrap();
    // A loop of first order, 100 1/s, that a chirp from 0.5 to 100 Hz drives in steps of 1 ms: -3 dB at 100 / 2 pi Hz.
    let ratio = f64::ln(100.0 / 0.5);
    let phase =
        |t: f64| std::f64::consts::TAU * 0.5 * 6.0 / ratio * ((ratio * t / 6.0).exp() - 1.0);
    let mut spool = 0.0;
    let mut text = String::from("time [s],command [V],spool [V]\n");
    for k in 0..6000 {
        let time = 1e-3 * f64::from(k);
        let command = 2.5 * phase(time).sin();
        let ripple = 0.002 * (7919.0 * time).sin();
        text += &format!("{time},{command},{}\n", spool + ripple);
        spool += (1.0 - (-0.1f64).exp()) * (command - spool);
    }
    write(folder.path().join("chirp.csv"), text).unwrap();
    let call = |accuracy: &str| {
        let call = [
            "identify",
            "chirp.csv",
            "--effects",
            "none",
            "--evaluator",
            "cpu",
            "--out",
            "out",
        ];
        servobee(
            folder.path(),
            &[&call[..], &["--accuracy", accuracy]].concat(),
        )
    };
    let refused = crate::program::refused(&call("flow=a lot"));
    assert!(refused.contains("flow=0.5 %, pressure=0.2 %"), "{refused}");
    let told = printed(&call("spool=0.5 %"));
    assert!(
        told.contains("Measured by spool over command at 25 % of full scale, 6 s: -3 dB at 25 %"),
        "{told}"
    );
    assert!(told.contains("Not measured: rated flow"), "{told}");

    let report = read_to_string(folder.path().join("out/report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let card = report["card"].as_array().unwrap();
    for figure in card {
        assert_ne!(
            figure["measured"].is_null(),
            figure["no_measured"].is_null(),
            "{figure}"
        );
    }
    let limit = card
        .iter()
        .find(|one| one["name"] == "amplitude_limit_25")
        .unwrap();
    let value = limit["measured"]["value"].as_f64().unwrap();
    assert!(
        (value - 100.0 / std::f64::consts::TAU).abs() < 0.4,
        "{limit}"
    );

    let page = read_to_string(folder.path().join("out/report.html")).unwrap();
    assert_well_formed(&page);
    let section = between(&page, "id=\"card\"", "</section>")[0];
    for part in [
        ">measured</th>",
        "measured by spool over command at 25 %",
        "not measured: no flow was measured",
    ] {
        assert!(section.contains(part), "{part}: {section}");
    }
}
