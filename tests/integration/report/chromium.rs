//! A headless Chromium that opens a page and says what became of it.

use std::path::PathBuf;
use std::process::{Command, Output};

use rotor_edge_tests::chromium;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use tempfile::TempDir;

/// Runs in the page and leaves what it measured as JSON in the document.
const MEASURE: &str = include_str!("../../report/measure.js");
/// Points at a figure, zooms it and leaves series out, and leaves what was seen.
const USE: &str = include_str!("../../report/use.js");
/// Longest that one page may take, s.
const PATIENCE_S: &str = "120";
/// Flags beside those of every browser; time passes as fast as the page's work is done.
const FLAGS: [&str; 2] = ["--virtual-time-budget=60000", "--hide-scrollbars"];

/// A page as it was laid out.
#[derive(Debug, Deserialize)]
pub struct Measured {
    pub figures: Vec<MeasuredFigure>,
    /// Contrast of the faintest text outside figures.
    pub faintest_text: f64,
    /// How far the page can be scrolled sideways.
    pub wider_than_screen_px: f64,
    /// Tables that can only be read by scrolling them.
    pub wide_tables: Vec<String>,
    pub width: f64,
    pub height: f64,
    /// Addresses that the page loaded.
    pub fetched: Vec<String>,
}

/// A figure as it was laid out.
#[derive(Debug, Deserialize)]
pub struct MeasuredFigure {
    pub id: String,
    pub width: f64,
    pub height: f64,
    pub shapes: usize,
    pub caption: String,
    pub smallest_text_px: f64,
    /// Contrast of the faintest text to the paper; WCAG asks for 4.5.
    pub faintest_text: f64,
    /// Texts that reach beyond the drawing.
    pub clipped: Vec<String>,
    /// Texts that lie over each other.
    pub overlapping: Vec<[String; 2]>,
}

/// Paths that are as wide and as high as such a figure is.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct Computed {
    pub orbits: usize,
    pub circles: usize,
}

/// What a reader saw who used a figure.
#[derive(Debug, Deserialize)]
pub struct Used {
    /// Numbers of the last measured point.
    pub last: Vec<f64>,
    /// What stood beside the pointer at that point.
    pub hover: String,
    /// All texts of the first figure of orbits, before anything was pointed at and at that first point.
    pub unpointed: Vec<String>,
    pub pointed: Vec<String>,
    /// All texts of the figure, before, zoomed, and after a reset.
    pub before: Vec<String>,
    pub zoomed: Vec<String>,
    pub reset: Vec<String>,
    /// Lines of models with all series, and without the first.
    pub all: usize,
    pub without: usize,
    /// What a screen reader says of the first point that the arrow key walks to.
    pub said: String,
    /// Rows of the tables of numbers.
    pub rows: usize,
    /// What the script computes and draws.
    pub computed: Computed,
}

/// How a reader's machine shows pages.
#[derive(Debug, Clone, Default)]
pub struct Look {
    pub is_dark: bool,
    /// The only folder of fonts, if not the machine's own.
    pub fonts: Option<PathBuf>,
}

pub struct Chromium {
    path: PathBuf,
    folder: TempDir,
}

impl Chromium {
    /// A browser, if one is to be had. Where `CI` is set there must be one.
    pub fn find() -> Option<Self> {
        let path = chromium::find("pages in a browser")?;
        Some(Self { path, folder: tempfile::tempdir().unwrap() })
    }

    /// What the page logs, line by line.
    pub fn console(&self, page: &str) -> Vec<String> {
        let output = self.open(page, &["--dump-dom", "--enable-logging=stderr", "--v=0"], &Look::default());
        assert!(String::from_utf8_lossy(&output.stdout).contains("</html>"), "the page did not load");
        let log = String::from_utf8_lossy(&output.stderr).into_owned();
        log.lines().filter(|l| l.contains("CONSOLE")).map(str::to_string).collect()
    }

    /// Lays the page out at this width.
    pub fn measure(&self, page: &str, width_px: u32, look: &Look) -> Measured {
        self.asked(page, width_px, look, MEASURE)
    }

    /// Uses a figure of the page as a reader would.
    pub fn used(&self, page: &str, figure: &str) -> Used {
        self.asked(page, 1280, &Look::default(), &format!("const FIGURE = {figure:?};\n{USE}"))
    }

    /// What a script answers that runs in the page.
    fn asked<T: DeserializeOwned>(&self, page: &str, width_px: u32, look: &Look, script: &str) -> T {
        let policy = page.find("<meta http-equiv").expect("a page has a policy");
        let end = policy + page[policy..].find('>').expect("the policy ends");
        // the policy would forbid the script that measures
        let open = format!("{}{}<script>{{{script}}}</script>", &page[..policy], &page[end + 1..]);
        let output = self.open(&framed(&open, width_px, 900.0), &["--dump-dom"], look);
        let dom = String::from_utf8(output.stdout).unwrap();
        let (_, rest) = dom.rsplit_once("<pre id=\"measured\">").expect("the page was measured");
        let json = rest.split("</pre>").next().unwrap_or_default();
        let json = json.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
        serde_json::from_str(&json).unwrap()
    }

    /// Leaves the page, a screenshot at each width and its print where `ROTOR_EDGE_REPORT_DIR` says.
    pub fn keep(&self, name: &str, page: &str, widths_px: &[u32]) {
        let Some(folder) = std::env::var_os("ROTOR_EDGE_REPORT_DIR").map(PathBuf::from) else { return };
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join(format!("{name}.html")), page).unwrap();
        for width_px in widths_px {
            let height_px = self.measure(page, *width_px, &Look::default()).height;
            let file = folder.join(format!("{name}-{width_px}.png")).display().to_string();
            self.open(
                &framed(page, *width_px, height_px),
                &[&format!("--screenshot={file}"), &format!("--window-size={width_px},{height_px}")],
                &Look::default(),
            );
        }
        let file = folder.join(format!("{name}.pdf")).display().to_string();
        self.open(page, &[&format!("--print-to-pdf={file}"), "--no-pdf-header-footer"], &Look::default());
    }

    /// Size of the page as it is printed, as PDF.
    pub fn print_bytes(&self, page: &str) -> usize {
        let file = self.folder.path().join("print.pdf");
        let print = format!("--print-to-pdf={}", file.display());
        self.open(page, &[&print, "--no-pdf-header-footer"], &Look { is_dark: true, fonts: None });
        std::fs::read(file).unwrap().len()
    }

    fn open(&self, page: &str, arguments: &[&str], look: &Look) -> Output {
        let run = tempfile::tempdir_in(self.folder.path()).unwrap();
        let file = run.path().join("page.html");
        std::fs::write(&file, page).unwrap();
        let mut command = Command::new("timeout");
        if let Some(fonts) = &look.fonts {
            let config = run.path().join("fonts.conf");
            let cache = run.path().join("fonts").display().to_string();
            let fonts = fonts.display();
            std::fs::write(
                &config,
                format!("<fontconfig><dir>{fonts}</dir><cachedir>{cache}</cachedir><include>/etc/fonts/conf.d</include></fontconfig>"),
            )
            .unwrap();
            command.env("FONTCONFIG_FILE", config);
        }
        let scheme = format!("--blink-settings=preferredColorScheme={}", u8::from(!look.is_dark));
        let output = command
            .arg(PATIENCE_S)
            .arg(&self.path)
            .args(chromium::FLAGS)
            .args(FLAGS)
            .arg(format!("--user-data-dir={}", run.path().join("profile").display()))
            .arg(scheme)
            .args(arguments)
            .arg(format!("file://{}", file.display()))
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{}: {said}", self.path.display());
        output
    }
}

/// A page that shows another at this size: a window of Chromium cannot be as narrow as a telephone.
fn framed(page: &str, width_px: u32, height_px: f64) -> String {
    let page = page.replace('&', "&amp;").replace('"', "&quot;");
    format!(
        "<!DOCTYPE html><html><meta charset=\"utf-8\"><body style=\"margin:0\"><iframe srcdoc=\"{page}\" \
         style=\"border:0;display:block;width:{width_px}px;height:{height_px}px\"></iframe></body></html>"
    )
}
