//! The page in a real browser: headless Chromium, driven through chromedriver's HTTP interface.
//!
//! Skipped, and said so, where they are not installed; `.ci/run` installs them. `TUSCHE_BROWSER=required` makes their
//! absence a failure.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value as Json, json};
use tusche::live::PageOptions;

use super::http::{Answer, request};
use super::{INK, LIMIT, Watching, options, place};

/// A browser with one window. Dropping it ends it.
pub(super) struct Browser {
    driver: Child,
    address: String,
    session: String,
    /// The browser's own folder.
    profile: tempfile::TempDir,
}

impl Browser {
    /// `None` where there is none.
    pub fn start() -> Option<Self> {
        let chromium = ["chromium", "chromium-browser", "google-chrome"].into_iter().find_map(found)?;
        let chromedriver = found("chromedriver")?;
        let mut driver = Command::new(chromedriver)
            .arg("--port=0")
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("chromedriver can be run");
        let mut lines = BufReader::new(driver.stdout.take().expect("it is piped")).lines().map_while(Result::ok);
        let port = lines.find_map(|line| {
            let number = line.split_once("started successfully on port ")?.1;
            number.trim_end_matches('.').parse::<u16>().ok()
        });
        let address = format!("127.0.0.1:{}", port.expect("chromedriver tells its port"));
        // What else it says must not fill the pipe.
        std::thread::spawn(move || lines.for_each(drop));
        let profile = tempfile::tempdir().expect("a temporary folder can be made");
        let data = format!("--user-data-dir={}", profile.path().display());
        let flags = [
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--disable-dev-shm-usage",
            "--window-size=1200,800",
            &data,
        ];
        let options = json!({ "args": flags, "binary": chromium });
        let capabilities = json!({ "capabilities": { "alwaysMatch": {
            "goog:chromeOptions": options,
            "goog:loggingPrefs": { "browser": "ALL" },
        } } });
        let mut browser = Self { driver, address, session: String::new(), profile };
        let begun = browser.call("POST", "/session", &capabilities);
        browser.session = format!("/session/{}", begun["sessionId"].as_str().expect("a session has an id"));
        Some(browser)
    }

    fn call(&self, method: &str, path: &str, body: &Json) -> Json {
        let url = format!("http://{}{path}", self.address);
        let answer: Answer = request(&url, method, &["Content-Type: application/json"], &body.to_string());
        let value = answer.json()["value"].clone();
        assert_eq!(answer.status, 200, "{method} {path}: {value:#}");
        value
    }

    pub fn open(&self, url: &str) {
        self.call("POST", &format!("{}/url", self.session), &json!({ "url": url }));
    }

    /// The value of a script that ends with `return`.
    pub fn run(&self, script: &str) -> Json {
        self.call("POST", &format!("{}/execute/sync", self.session), &json!({ "script": script, "args": [] }))
    }

    /// Runs a script until it gives something that counts as true.
    #[track_caller]
    pub fn wait(&self, script: &str) -> Json {
        let end = Instant::now() + LIMIT;
        loop {
            let value = self.run(script);
            if !matches!(value, Json::Null | Json::Bool(false)) {
                return value;
            }
            assert!(
                Instant::now() < end,
                "never true: {script}\nthe page says: {}",
                self.run("return document.body.innerText")
            );
            std::thread::sleep(Duration::from_millis(30));
        }
    }

    /// What the page's console has, errors and refused resources.
    fn complaints(&self) -> Vec<Json> {
        let log = self.call("POST", &format!("{}/se/log", self.session), &json!({ "type": "browser" }));
        log.as_array().cloned().unwrap_or_default()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        if !std::thread::panicking() && !self.session.is_empty() {
            self.call("DELETE", &self.session, &json!({}));
        }
        let _ = self.driver.kill();
        let _ = self.driver.wait();
        // Named so that it lives until here.
        let _ = &self.profile;
    }
}

/// The path of a program.
fn found(program: &str) -> Option<String> {
    let folders = std::env::var_os("PATH")?;
    std::env::split_paths(&folders)
        .map(|folder| folder.join(program))
        .find(|path| path.is_file())
        .map(|path| path.display().to_string())
}

/// How many pixels of the shown picture are dark.
const DARK: &str = "const data = document.getElementById('picture').getContext('2d').getImageData(0, 0, 32, 24).data;
    let dark = 0;
    for (let i = 0; i < data.length; i += 4) dark += data[i] < 120;
    return dark;";

#[test]
fn the_page_in_a_browser() {
    let Some(browser) = Browser::start() else {
        assert!(std::env::var("TUSCHE_BROWSER").as_deref() != Ok("required"), "chromium or chromedriver is missing");
        eprintln!("SKIPPED: the_page_in_a_browser needs chromium and chromedriver (Debian: chromium, chromium-driver)");
        return;
    };
    let place = place();
    let mut options = options(&place);
    options.page = Some(PageOptions::LOCAL);
    let watching = Watching::start(options);
    browser.open(watching.url());

    // A picture appears.
    browser.wait("return document.getElementById('picture').dataset.final === 'true'");
    assert_eq!(
        browser.run("const c = document.getElementById('picture'); return [c.width, c.height]"),
        json!([32, 24])
    );
    let dark = browser.run(DARK).as_u64().expect("a count");
    assert!(dark > 20, "there are no lines: {dark} dark pixels");
    assert_eq!(browser.run("return document.getElementById('faults').hidden"), json!(true));

    // A slider makes lines wider.
    let slider =
        "const slider = document.querySelector('input[type=range][aria-label=\"materials ink params ink_width\"]');";
    assert_eq!(
        browser.wait(&format!("{slider} return slider && [slider.min, slider.max, slider.value]")),
        json!(["0", "12", "2"])
    );
    browser.run(&format!("{slider} slider.value = 8; slider.dispatchEvent(new Event('input', {{ bubbles: true }}))"));
    browser.wait(&DARK.replace("return dark", &format!("return dark > {dark} + 20")));
    browser.wait("return document.getElementById('count').textContent === '1 edit'");
    browser.wait("return document.getElementById('toml').textContent.includes('ink_width = 8')");

    // A broken script shows its message, keeps the picture, and goes when it is mended.
    place.file("ink.rhai", INK.replace("color: p.paper", "colour: p.paper"));
    let message = browser.wait("const f = document.getElementById('faults'); return !f.hidden && f.textContent");
    let message = message.as_str().unwrap_or("");
    assert!(message.contains("ink.rhai:7:") && message.contains("colour: p.paper"), "{message}");
    assert!(browser.run(DARK).as_u64().is_some_and(|now| now > dark));
    place.file("ink.rhai", INK);
    browser.wait("return document.getElementById('faults').hidden");

    // Why is this line here?
    browser.run("why(16, 3)");
    browser.wait("return document.getElementById('explanation').textContent.startsWith('pixel 16, 3')");

    // What the picture cost, and what of it was known before.
    let cost = browser.run("return document.querySelector('footer').textContent");
    let cost = cost.as_str().unwrap_or("");
    for part in ["2 samples", "trace", "shade", "lines", "film", "done again: rays", "rays, "] {
        assert!(cost.contains(part), "`{part}` is not in `{cost}`");
    }
    assert_eq!(browser.run("return document.getElementById('memory').hidden"), json!(true));

    // By keyboard: the next layer and back, exposure, a setting, help.
    let press = |key: &str| {
        let event = format!("new KeyboardEvent('keydown', {{ key: '{key}', bubbles: true, cancelable: true }})");
        browser.run(&format!("(document.activeElement ?? document.body).dispatchEvent({event})"));
    };
    press("l");
    browser.wait("return picture.layer === 'color'");
    press("L");
    browser.wait("return picture.layer === 'rgba'");
    press("]");
    assert_eq!(browser.run("return document.getElementById('stops').textContent"), json!("+0.25"));
    press("\\\\");
    assert_eq!(browser.run("return document.getElementById('stops').textContent"), json!("0"));
    press("/");
    assert_eq!(browser.run("return document.activeElement.id"), json!("filter"));
    press("Escape");
    press("?");
    assert_eq!(browser.run("return document.getElementById('keys').open"), json!(true));
    browser.run("document.getElementById('keys').close()");
    // When a dialog closes, the browser may give the focus to a field, which takes the first Escape.
    browser.wait(
        "(document.activeElement ?? document.body).dispatchEvent(
            new KeyboardEvent('keydown', { key: 'Escape', bubbles: true, cancelable: true }));
        return document.getElementById('why').hidden",
    );

    // The edit goes into the file, and none is left.
    browser.run("document.getElementById('save').click()");
    browser.wait("return document.getElementById('count').textContent === 'no edits'");
    let text = std::fs::read_to_string(place.folder.path().join("scene.toml")).expect("it is there");
    assert!(text.contains("ink_width = 8"), "{text}");

    // Nothing was refused by the page's own policy, and no script failed.
    let complaints = browser.complaints();
    assert!(complaints.is_empty(), "{complaints:#?}");
}
