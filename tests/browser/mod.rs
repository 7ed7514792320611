//! A page in a headless browser.

use serde::Deserialize;
use std::ffi::OsString;
use std::fs::{metadata, read, write};
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

/// Names by which a browser is looked for.
const NAMES: [&str; 4] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
];

/// How the style of a page says what holds on paper.
const PRINT: &str = "@media print {";
/// How wide A4 is between margins of 14 mm, in pixels of 1/96 inch.
const A4_WIDE: u32 = 688;
/// What nobody wants to print more than.
const MOST_SHEETS: usize = 15;

/// Writes into the page what is where on it.
const MEASURE: &str = r#"<script>
const plots = [...document.querySelectorAll("figure svg[role=img]")].map(svg => {
  const all = svg.getBoundingClientRect();
  const texts = [...svg.querySelectorAll("text")].map(t => [t.textContent.trim(), t.getBoundingClientRect()]);
  const outside = texts.filter(([, b]) => b.left < all.left - 1 || b.right > all.right + 1 || b.top < all.top - 1
    || b.bottom > all.bottom + 1).map(([t]) => t);
  const overlaps = [];
  texts.forEach(([a, p], i) => texts.slice(i + 1).forEach(([b, q]) => {
    const wide = Math.min(p.right, q.right) - Math.max(p.left, q.left);
    const high = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
    if (wide > 1 && high > 3) overlaps.push(a + " | " + b);
  }));
  return { figure: svg.closest("figure").id, width: all.width, height: all.height, outside, overlaps };
});
const style = getComputedStyle(document.body);
const strokes = [...document.querySelectorAll("figure .panel polyline")].map(l => getComputedStyle(l));
// What is as thick as a bar is an area: its colour need not stand out.
const lines = [...new Set(strokes.filter(s => parseFloat(s.strokeWidth) < 16 && parseFloat(s.strokeWidth) > 4).map(s => s.stroke))];
const pre = document.createElement("pre");
pre.id = "measured";
pre.textContent = JSON.stringify({ plots, lines, paper: style.backgroundColor, ink: style.color,
  content: document.documentElement.scrollWidth, window: document.documentElement.clientWidth });
document.body.append(pre);
</script>"#;

/// What a browser made of a page.
#[derive(Debug, Deserialize)]
pub(crate) struct Shown {
    /// Messages on the console.
    #[serde(default)]
    pub(crate) complaints: Vec<String>,
    pub(crate) plots: Vec<Plot>,
    /// Colours of the lines in plots.
    pub(crate) lines: Vec<String>,
    pub(crate) paper: String,
    pub(crate) ink: String,
    /// Width of what is on the page, and of the window, in pixels.
    pub(crate) content: f64,
    pub(crate) window: f64,
}

/// A plot as it is shown.
#[derive(Debug, Deserialize)]
pub(crate) struct Plot {
    pub(crate) figure: String,
    pub(crate) width: f64,
    pub(crate) height: f64,
    /// Texts that its edge cuts off.
    pub(crate) outside: Vec<String>,
    /// Texts that lie on each other.
    pub(crate) overlaps: Vec<String>,
}

/// A browser that can be run without a screen.
pub(crate) struct Browser(OsString);

impl Browser {
    /// The one that `SERVOBEE_BROWSER` names, or one that is installed; `None` where that is allowed to be missing.
    pub(crate) fn find() -> Option<Self> {
        if std::env::var("SERVOBEE_SKIP_BROWSER").is_ok_and(|value| value == "1") {
            println!("SKIPPED: SERVOBEE_SKIP_BROWSER=1: no page was opened in a browser");
            return None;
        }
        let named = std::env::var_os("SERVOBEE_BROWSER");
        let runs = |name: &OsString| {
            Command::new(name)
                .arg("--version")
                .output()
                .is_ok_and(|ran| ran.status.success())
        };
        let found = named
            .into_iter()
            .chain(NAMES.map(OsString::from))
            .find(runs);
        let Some(found) = found else {
            panic!(
                "no browser: install one (Debian: apt-get install chromium), let SERVOBEE_BROWSER name it, or set \
                 SERVOBEE_SKIP_BROWSER=1"
            );
        };
        Some(Self(found))
    }

    /// Opens a copy of `page` that measures itself.
    pub(crate) fn show(&self, page: &str, width: u32, dark: bool) -> Shown {
        let folder = TempDir::new().unwrap();
        let (before, after) = page.rsplit_once("</body>").expect("a body");
        write(
            folder.path().join("page.html"),
            format!("{before}{MEASURE}</body>{after}"),
        )
        .unwrap();
        let scheme = if dark {
            "preferredColorScheme=0"
        } else {
            "preferredColorScheme=1"
        };
        let ran = self.run(
            folder.path(),
            &[
                &format!("--window-size={width},2000"),
                &format!("--blink-settings={scheme}"),
                "--dump-dom",
            ],
        );
        let text = String::from_utf8(ran.stdout).unwrap();
        let errors = String::from_utf8_lossy(&ran.stderr).into_owned();
        let start = text
            .find("<pre id=\"measured\">")
            .unwrap_or_else(|| panic!("nothing measured: {errors}"));
        let json = text[start..]
            .split_once('>')
            .unwrap()
            .1
            .split_once("</pre>")
            .unwrap()
            .0;
        let json = json
            .replace("&lt;", "<")
            .replace("&gt;", ">")
            .replace("&amp;", "&");
        let mut shown: Shown = serde_json::from_str(&json).unwrap();
        shown.complaints = errors
            .lines()
            .filter(|line| line.contains("CONSOLE"))
            .map(str::to_owned)
            .collect();
        shown
    }

    /// The size in bytes of a picture of `page`, as it is.
    pub(crate) fn picture(&self, page: &str, folder: &Path) -> u64 {
        write(folder.join("page.html"), page).unwrap();
        let picture = folder.join("page.png");
        self.run(
            folder,
            &[
                "--window-size=1100,4000",
                &format!("--screenshot={}", picture.display()),
            ],
        );
        metadata(&picture).expect("a picture").len()
    }

    /// On paper as narrow as A4 nothing of `page` is cut off, and on Letter, which is shorter, it takes a few sheets.
    pub(crate) fn assert_prints(&self, page: &str, place: &str) {
        assert!(page.contains(PRINT), "{place}: no layout for paper");
        let shown = self.show(&page.replace(PRINT, "@media all {"), A4_WIDE, false);
        let wide = shown.content;
        assert!(
            wide <= shown.window,
            "{place}: {wide} pixels on paper of {A4_WIDE}"
        );
        for plot in &shown.plots {
            assert!(plot.width <= shown.window, "{place}: {plot:?}");
            assert!(
                plot.outside.is_empty() && plot.overlaps.is_empty(),
                "{place}: {plot:?}"
            );
        }
        let sheets = self.sheets(page);
        assert!(
            (1..=MOST_SHEETS).contains(&sheets),
            "{place}: {sheets} sheets"
        );
    }

    /// On how many sheets of Letter, which is what a browser without a screen takes, `page` is printed.
    pub(crate) fn sheets(&self, page: &str) -> usize {
        let folder = TempDir::new().unwrap();
        write(folder.path().join("page.html"), page).unwrap();
        let file = folder.path().join("page.pdf");
        self.run(
            folder.path(),
            &[&format!("--print-to-pdf={}", file.display())],
        );
        let text = String::from_utf8_lossy(&read(&file).expect("a file to print")).into_owned();
        let pages = text.split("/Type /Page").skip(1);
        pages.filter(|rest| !rest.starts_with('s')).count()
    }

    fn run(&self, folder: &Path, arguments: &[&str]) -> Output {
        let ran = Command::new(&self.0)
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--hide-scrollbars",
            ])
            .args(["--enable-logging=stderr", "--v=0"])
            .arg(format!(
                "--user-data-dir={}",
                folder.join("profile").display()
            ))
            .args(arguments)
            .arg(format!("file://{}", folder.join("page.html").display()))
            .output()
            .unwrap();
        assert!(
            ran.status.success(),
            "{}",
            String::from_utf8_lossy(&ran.stderr)
        );
        ran
    }
}

/// Relative luminance (WCAG 2) of `rgb(r, g, b)`.
pub(crate) fn luminance(colour: &str) -> f64 {
    let parts = colour
        .trim_start_matches("rgb(")
        .trim_end_matches(')')
        .split(", ");
    let linear = |part: &str| {
        let value = part.parse::<f64>().unwrap_or_else(|_| panic!("{colour}")) / 255.0;
        if value <= 0.040_45 {
            value / 12.92
        } else {
            ((value + 0.055) / 1.055).powf(2.4)
        }
    };
    parts
        .zip([0.2126, 0.7152, 0.0722])
        .map(|(part, weight)| weight * linear(part))
        .sum()
}

/// How far two colours stand out from each other: 1 for the same, 21 for black on white (WCAG 2).
pub(crate) fn contrast(a: &str, b: &str) -> f64 {
    let (a, b) = (luminance(a), luminance(b));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}
