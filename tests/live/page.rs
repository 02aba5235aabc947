//! The page's server: what it serves, and whom it refuses.

use serde_json::json;
use tusche::live::{Kept, News, PageOptions};

use super::http::{Answer, Events, get, parts, post, request, send};
use super::{INK, SCENE, Watching, inked, options, place};
use crate::common::Workplace;

fn watching(place: &Workplace) -> Watching {
    let mut options = options(place);
    options.page = Some(PageOptions::LOCAL);
    Watching::start(options)
}

/// The numbers before the pixels, and the pixels.
fn pixels(answer: &Answer) -> ([u32; 7], &[u8]) {
    assert_eq!(answer.status, 200, "{}", answer.text());
    let (head, pixels) = answer.body.split_at(28);
    let number = |i: usize| u32::from_le_bytes(head[4 * i..4 * i + 4].try_into().expect("four bytes"));
    (std::array::from_fn(number), pixels)
}

#[test]
fn the_page_is_one_file_with_a_strict_policy() {
    let place = place();
    let watching = watching(&place);
    let page = get(watching.url());
    assert_eq!(page.status, 200);
    let nonce = page.head.split("'nonce-").nth(1).and_then(|rest| rest.split('\'').next()).expect("there is a nonce");
    let text = page.text();
    assert_eq!(text.matches(&format!("nonce=\"{nonce}\"")).count(), 2);
    for forbidden in ["http://", "https://", "src=", "@import", "NONCE", "onclick=", "style=\"", "eval("] {
        let found = text.match_indices(forbidden).map(|(at, _)| &text[at..(at + 60).min(text.len())]);
        // Names of XML are no addresses.
        let found: Vec<_> = found.filter(|found| !found.starts_with("http://www.w3.org/2000/svg")).collect();
        assert!(found.is_empty(), "{forbidden}: {found:?}");
    }
    for header in [
        "default-src 'none'",
        "frame-ancestors 'none'",
        "cache-control: no-store",
        "x-content-type-options: nosniff",
        "referrer-policy: no-referrer",
        "cross-origin-resource-policy: same-origin",
    ] {
        assert!(page.head.contains(header), "{header} is missing:\n{}", page.head);
    }
    assert!(!page.head.contains("access-control"));
    // Each page has a nonce of its own.
    assert!(!get(watching.url()).head.contains(nonce));
}

#[test]
fn pictures_come_whole_or_in_the_part_that_changed() {
    let place = place();
    let watching = watching(&place);
    watching.picture();
    let url = |query: &str| format!("{}picture?{query}", watching.url());
    let whole = get(&url("have=0"));
    let ([revision, x, y, width, height, full_width, full_height], bytes) = pixels(&whole);
    assert_eq!([x, y, width, height, full_width, full_height], [0, 0, 32, 24, 32, 24]);
    assert_eq!(bytes.len(), 32 * 24 * 4);
    // The background: a quarter of the light is 137 in sRGB.
    assert_eq!(bytes[..4], [137, 137, 137, 255]);
    let (numbers, bytes) = {
        let answer = get(&url(&format!("have={revision}")));
        let (numbers, bytes) = pixels(&answer);
        (numbers, bytes.to_vec())
    };
    assert_eq!((numbers[3] * numbers[4], bytes.len()), (0, 0));
    let brighter = get(&url("have=0&exposure=1"));
    assert_eq!(pixels(&brighter).1[..4], [188, 188, 188, 255]);
    // What makes no sense is as if it were not there.
    for query in ["", "have=-1", "have=x&exposure=nan", "exposure=1e30", "have=99999999999999999999", "&&==&"] {
        assert_eq!(get(&url(query)).body, whole.body, "{query}");
    }
}

#[test]
fn layers_are_chosen_by_name() {
    let place = place();
    let watching = watching(&place);
    watching.picture();
    let mut events = Events::open(&format!("{}events", watching.url()));
    let scene = events.wait("scene", |_| true);
    assert!(
        scene["layers"]
            .as_array()
            .is_some_and(|layers| layers.contains(&json!("N")) && !layers.contains(&json!("feature")))
    );
    assert_eq!(post(&format!("{}layer", watching.url()), &json!({ "layer": "N" })).status, 204);
    events.wait("picture", |picture| picture["layer"] == "N");
    let answer = get(&format!("{}picture", watching.url()));
    let (_, bytes) = pixels(&answer);
    assert_eq!(bytes[..4], [0, 0, 0, 255]);
    let middle = 4 * (12 * 32 + 16);
    assert!(bytes[middle + 2] > 240, "the ball's normal points here: {:?}", &bytes[middle..middle + 4]);
    // A layer that is not there shows the picture.
    assert_eq!(post(&format!("{}layer", watching.url()), &json!({ "layer": "aov_nothing" })).status, 204);
    events.wait("picture", |picture| picture["layer"] == "rgba");
}

#[test]
fn controls_have_ranges_values_and_help() {
    let place = place();
    let watching = watching(&place);
    watching.picture();
    let scene = Events::open(&format!("{}events", watching.url())).wait("scene", |scene| !scene["groups"].is_null());
    let groups = scene["groups"].as_array().expect("there are groups");
    let titles: Vec<_> = groups.iter().map(|group| group["title"].as_str().unwrap_or("")).collect();
    assert_eq!(titles, ["lines", "ink", "render"]);
    let control = |path: &[&str]| {
        let all = groups.iter().flat_map(|group| group["controls"].as_array().expect("groups have controls"));
        let found = all.into_iter().find(|control| control["path"] == json!(path));
        found.unwrap_or_else(|| panic!("{path:?} has no control")).clone()
    };
    let width = control(&["materials", "ink", "params", "ink_width"]);
    assert_eq!(width["slider"], json!([0.0, 12.0]));
    assert_eq!((&width["value"], &width["default"], &width["kind"]), (&json!(2.0), &json!(2.0), &json!("number")));
    assert_eq!(width["help"], "pixels, 0 … 12");
    let paper = control(&["materials", "ink", "params", "paper"]);
    assert_eq!(paper["kind"], "color");
    assert_eq!((&paper["value"], &paper["default"]), (&json!([0.8, 0.7, 0.5]), &json!([0.9, 0.9, 0.9])));
    assert_eq!(control(&["lines", "normal"])["kind"], "threshold");
    assert_eq!(control(&["lines", "types", "crease", "width"])["value"], json!(null));
    assert_eq!(control(&["lines", "width"])["max"], 1024.0);
}

#[test]
fn a_page_edits_reverts_and_saves() {
    let place = place();
    let watching = watching(&place);
    let first = watching.picture();
    let mut events = Events::open(&format!("{}events", watching.url()));
    let edit = json!({ "edits": [{ "path": ["materials", "ink", "params", "ink_width"], "value": 8 }] });
    assert_eq!(post(&format!("{}edit", watching.url()), &edit).status, 204);
    watching.picture_with("picture with wider lines", |picture| inked(picture) > inked(&first));
    let scene = events.wait("scene", |scene| scene["edits"] != json!([]));
    assert_eq!(scene["toml"], "[materials.ink]\nparams = { ink_width = 8 }\n");
    assert_eq!(post(&format!("{}save", watching.url()), &json!({})).status, 204);
    let text = std::fs::read_to_string(place.folder.path().join("scene.toml")).expect("it is there");
    assert_eq!(text, SCENE.replace("0.5] }", "0.5], ink_width = 8 }"));
    events.wait("scene", |scene| scene["edits"] == json!([]));
    for (route, body) in [
        ("edit", json!({ "edits": [{ "path": "lines.width", "value": 8 }] })),
        ("edit", json!({})),
        ("edit", json!({ "edits": [], "more": 1 })),
        ("layer", json!({ "layer": 3 })),
        ("revert", json!([])),
    ] {
        assert_eq!(post(&format!("{}{route}", watching.url()), &body).status, 400, "{route} {body}");
    }
    assert_eq!(post(&format!("{}nothing", watching.url()), &json!({})).status, 404);
}

#[test]
fn faults_are_shown_with_their_snippet_and_go() {
    let place = place();
    let watching = watching(&place);
    watching.picture();
    let mut events = Events::open(&format!("{}events", watching.url()));
    place.file("ink.rhai", INK.replace("color: p.paper", "colour: p.paper"));
    let faults = events.wait("faults", |faults| faults["list"] != json!([]));
    assert_eq!(faults["stale"], true);
    let fault = &faults["list"][0];
    assert_eq!(fault["severity"], "error");
    assert!(fault["place"].as_str().is_some_and(|place| place.contains("ink.rhai:7:")), "{fault}");
    assert!(fault["text"].as_str().is_some_and(|text| text.contains("colour: p.paper")), "{fault}");
    assert_eq!(get(&format!("{}picture", watching.url())).status, 200, "the last good picture stays");
    place.file("ink.rhai", INK);
    events.wait("faults", |faults| faults["list"] == json!([]));
}

#[test]
fn a_memory_limit_that_is_too_small_is_told() {
    let place = place();
    let mut options = options(&place);
    options.page = Some(PageOptions::LOCAL);
    options.session.cache_bytes = 0;
    let watching = Watching::start(options);
    let cache = watching.wait("word of the memory limit", |news| match news {
        News::Memory(cache) => Some(*cache),
        _ => None,
    });
    assert_eq!((cache.kept, cache.limit), (Kept::Nothing, 0));
    let mut events = Events::open(&format!("{}events", watching.url()));
    let picture = events.wait("picture", |picture| picture["final"] == true);
    assert!(picture["memory"].as_str().is_some_and(|text| text.contains("only the picture is kept")), "{picture}");
    // Where there is room, nothing is said.
    drop(watching);
    let watching = self::watching(&place);
    let mut events = Events::open(&format!("{}events", watching.url()));
    assert_eq!(events.wait("picture", |picture| picture["final"] == true)["memory"], json!(null));
}

#[test]
fn a_line_is_explained() {
    let place = place();
    let watching = watching(&place);
    watching.picture();
    let explained = get(&format!("{}why?x=16.5&y=3.5", watching.url()));
    assert_eq!(explained.status, 200);
    let text = explained.json()["text"].as_str().expect("there is a text").to_owned();
    assert!(text.starts_with("pixel 16, 3: "), "{text}");
    for query in ["x=-1&y=0", "x=1e9&y=1", "x=1", "", "x=nan&y=1"] {
        assert_eq!(get(&format!("{}why?{query}", watching.url())).status, 400, "{query}");
    }
}

#[test]
fn strangers_are_refused() {
    let place = place();
    let watching = watching(&place);
    watching.picture();
    let url = watching.url();
    let (host, path) = parts(url);
    let port = host.rsplit(':').next().expect("there is a port");
    let own = |route: &str| format!("http://{host}{path}{route}");
    // Without the token, or with another.
    let other = path.replace(|c: char| c.is_ascii_hexdigit(), "0");
    for wrong in ["/", "/events", "/picture", &other, &path[..path.len() - 1], &path[..path.len() - 2]] {
        assert_eq!(get(&format!("http://{host}{wrong}")).status, 404, "{wrong}");
    }
    // By a name that anybody could lead here.
    for name in [format!("evil.example:{port}"), "evil.example".into(), format!("localhost.evil.example:{port}")] {
        assert_eq!(request(url, "GET", &[&format!("Host: {name}")], "").status, 403, "{name}");
    }
    assert_eq!(request(url, "GET", &[&format!("Host: localhost:{port}")], "").status, 200);
    // From other origins.
    let json = "Content-Type: application/json";
    for origin in ["http://evil.example", "null", "http://127.0.0.1:1", "https://127.0.0.1"] {
        let origin = format!("Origin: {origin}");
        assert_eq!(request(&own("edit"), "POST", &[json, &origin], "{\"edits\": []}").status, 403, "{origin}");
        assert_eq!(request(&own("events"), "GET", &[&origin], "").status, 403, "{origin}");
    }
    let form = "Content-Type: application/x-www-form-urlencoded";
    assert_eq!(request(&own("save"), "POST", &[form], "").status, 415);
    assert_eq!(request(&own("save"), "POST", &["Content-Type: text/plain"], "{}").status, 415);
    for method in ["PUT", "DELETE", "OPTIONS", "HEAD", "TRACE", "PATCH"] {
        let text = format!("{method} {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
        assert_eq!(send(host, text.as_bytes()).map(|answer| answer.status), Some(405), "{method}");
    }
}

#[test]
fn no_path_leads_to_a_file() {
    let place = place();
    place.file("secret.txt", "secret");
    let watching = watching(&place);
    watching.picture();
    let (host, path) = parts(watching.url());
    for route in [
        "secret.txt",
        "scene.toml",
        "../scene.toml",
        "..%2fscene.toml",
        "%2e%2e/%2e%2e/etc/passwd",
        "....//....//etc/passwd",
        "/etc/passwd",
        "picture/../../scene.toml",
        "events/",
        "page.html",
        "..\\..\\scene.toml",
        "%00",
        ".",
        "./",
        "//",
    ] {
        let text = format!("GET {path}{route} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
        let answer = send(host, text.as_bytes()).expect("there is an answer");
        assert!(matches!(answer.status, 400 | 404), "{route}: {}", answer.status);
        assert!(!answer.text().contains("secret") && !answer.text().contains("root:"), "{route}");
    }
}

#[test]
fn requests_have_limits() {
    let place = place();
    let watching = watching(&place);
    watching.picture();
    let (host, path) = parts(watching.url());
    let long = "x".repeat(100 << 10);
    let many: String = (0..200).map(|i| format!("X-{i}: 1\r\n")).collect();
    for text in [
        format!("GET {path}?{long} HTTP/1.1\r\nHost: {host}\r\n\r\n"),
        format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nX: {long}\r\n\r\n"),
        format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n{many}\r\n"),
    ] {
        let answer = send(host, text.as_bytes());
        assert!(answer.is_none_or(|answer| matches!(answer.status, 400 | 414 | 431)), "{}", &text[..80]);
    }
    let body = format!("{{\"edits\": [{{\"path\": [\"a\"], \"value\": \"{long}\"}}]}}");
    assert_eq!(
        request(&format!("{}edit", watching.url()), "POST", &["Content-Type: application/json"], &body).status,
        413
    );
    let with_body =
        format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nContent-Length: 5\r\nConnection: close\r\n\r\nhello");
    assert_eq!(send(host, with_body.as_bytes()).map(|answer| answer.status), Some(400));
    assert_eq!(get(watching.url()).status, 200);
}

#[test]
fn clients_that_stall_are_dropped() {
    let place = place();
    let watching = watching(&place);
    watching.picture();
    let (host, path) = parts(watching.url());
    let head =
        format!("POST {path}edit HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\nContent-Length: 99\r\n");
    // Nothing, half a head, and half a body; all at once, since each has its ten seconds.
    let stalled = ["".to_owned(), head.clone(), format!("{head}\r\n{{")].map(|text| {
        let mut stream = std::net::TcpStream::connect(host).expect("the server takes connections");
        stream.set_read_timeout(Some(super::LIMIT)).expect("time limits can be set");
        std::io::Write::write_all(&mut stream, text.as_bytes()).expect("it can be sent");
        (text, stream)
    });
    for (text, mut stream) in stalled {
        let end = std::io::Read::read_to_end(&mut stream, &mut Vec::new());
        assert!(end.is_ok(), "the server still waits after {text:?}");
    }
    assert_eq!(get(watching.url()).status, 200);
}

#[test]
fn ten_thousand_malformed_requests_leave_it_serving() {
    let place = place();
    let watching = watching(&place);
    watching.picture();
    let (host, path) = parts(watching.url());
    let good = format!(
        "POST {path}edit HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\nContent-Length: 13\r\nConnection: close\r\n\r\n{{\"edits\": []}}"
    );
    let good = good.as_bytes();
    let mut state = 1_u32;
    let mut random = |below: usize| {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state as usize % below
    };
    for round in 0..10_000 {
        let mut bytes = good.to_vec();
        match round % 5 {
            // Cut off, changed here and there, out of order, doubled, or noise.
            0 => bytes.truncate(random(good.len())),
            1 => (0..1 + random(8)).for_each(|_| bytes[random(good.len())] = random(256) as u8),
            2 => bytes.rotate_left(1 + random(good.len() - 1)),
            3 => {
                let at = random(good.len());
                bytes.splice(at..at, good[..random(good.len())].iter().copied());
            }
            _ => bytes = (0..random(300)).map(|_| random(256) as u8).collect(),
        }
        let mut stream = std::net::TcpStream::connect(host).expect("the server takes connections");
        // The server may have closed already, and most answers do not matter.
        let _ = std::io::Write::write_all(&mut stream, &bytes);
        if round % 100 == 0 {
            let _ = stream.shutdown(std::net::Shutdown::Write);
            let _ = std::io::Read::read_to_end(&mut stream, &mut Vec::new());
            assert_eq!(get(watching.url()).status, 200, "after {round} requests");
        }
    }
    let answer = send(host, good).expect("there is an answer");
    assert_eq!(answer.status, 204);
}

#[test]
fn many_pages_at_once_and_pages_that_leave() {
    let place = place();
    let watching = watching(&place);
    watching.picture();
    let url = format!("{}events", watching.url());
    for _ in 0..200 {
        drop(Events::open(&url));
    }
    let mut pages: Vec<_> = (0..20).map(|_| Events::open(&url)).collect();
    place.file("scene.toml", SCENE.replace("samples = 2", "samples = 3"));
    for page in &mut pages {
        page.wait("picture", |picture| picture["samples"] == 3 && picture["final"] == true);
    }
    assert_eq!(get(watching.url()).status, 200);
}

#[test]
fn a_port_that_is_taken_is_told() {
    let place = place();
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let port = taken.local_addr().expect("it has an address").port();
    let mut options = options(&place);
    options.page = Some(PageOptions { port, ..PageOptions::LOCAL });
    let fault = tusche::live::Watch::new(options).err().expect("the port is taken").to_string();
    assert!(fault.contains("cannot serve the page at 127.0.0.1:") && fault.contains("--port"), "{fault}");
}
