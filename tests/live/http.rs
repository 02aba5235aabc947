//! As much of an HTTP client as the tests need.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// An answer.
#[derive(Debug)]
pub struct Answer {
    pub status: u16,
    /// The head as it came, in lower case.
    pub head: String,
    pub body: Vec<u8>,
}

impl Answer {
    pub fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }

    pub fn json(&self) -> serde_json::Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|error| panic!("{error}: {}", self.text()))
    }
}

/// The parts of an `http` address: `HOST:PORT`, and the path from its `/` on.
pub fn parts(url: &str) -> (&str, &str) {
    let rest = url.strip_prefix("http://").expect("it is an http address");
    rest.split_at(rest.find('/').unwrap_or(rest.len()))
}

/// Sends bytes and reads whatever comes until the end of the answer; `None` if nothing does.
pub fn send(address: &str, bytes: &[u8]) -> Option<Answer> {
    let mut stream = TcpStream::connect(address).expect("the server takes connections");
    stream.set_read_timeout(Some(Duration::from_secs(60))).expect("time limits can be set");
    // A server that refuses early may close before all is sent.
    let _ = stream.write_all(bytes);
    let mut reader = BufReader::new(stream);
    let mut head = String::new();
    let mut line = String::new();
    while reader.read_line(&mut line).ok()? > 0 && line.trim() != "" {
        head += &line.to_lowercase();
        line.clear();
    }
    let status = head.split(' ').nth(1)?.parse().ok()?;
    let length = head.lines().find_map(|line| line.strip_prefix("content-length:"));
    let mut body = Vec::new();
    match length {
        // What is announced is what a GET would give.
        Some(_) if bytes.starts_with(b"HEAD") => {}
        Some(length) => {
            body.resize(length.trim().parse().expect("the length is a number"), 0);
            reader.read_exact(&mut body).expect("the body is as long as announced");
        }
        None if status == 204 => {}
        None => drop(reader.read_to_end(&mut body)),
    }
    Some(Answer { status, head, body })
}

/// A request with these header lines more than it needs.
pub fn request(url: &str, method: &str, headers: &[&str], body: &str) -> Answer {
    let (host, path) = parts(url);
    let own_host =
        if headers.iter().any(|line| line.starts_with("Host:")) { String::new() } else { format!("Host: {host}\r\n") };
    let more: String = headers.iter().map(|line| format!("{line}\r\n")).collect();
    let length = if method == "GET" { String::new() } else { format!("Content-Length: {}\r\n", body.len()) };
    let text = format!("{method} {path} HTTP/1.1\r\n{own_host}{more}{length}Connection: close\r\n\r\n{body}");
    send(host, text.as_bytes()).expect("there is an answer")
}

pub fn get(url: &str) -> Answer {
    request(url, "GET", &[], "")
}

pub fn post(url: &str, body: &serde_json::Value) -> Answer {
    request(url, "POST", &["Content-Type: application/json"], &body.to_string())
}

/// A stream of server-sent events.
pub struct Events {
    reader: BufReader<TcpStream>,
    /// Between chunks of the transfer.
    buffer: String,
}

impl Events {
    pub fn open(url: &str) -> Self {
        let (host, path) = parts(url);
        let mut stream = TcpStream::connect(host).expect("the server takes connections");
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("time limits can be set");
        write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n").expect("it can be sent");
        let mut reader = BufReader::new(stream);
        let mut line = String::new();
        while reader.read_line(&mut line).expect("there is a head") > 0 && line.trim() != "" {
            line.clear();
        }
        Self { reader, buffer: String::new() }
    }

    /// The next event: its name and its data.
    pub fn next(&mut self) -> (String, serde_json::Value) {
        loop {
            if let Some((event, rest)) = self.buffer.split_once("\n\n") {
                let field = |name: &str| event.lines().find_map(|line| line.strip_prefix(name)).map(str::to_owned);
                let found = field("event: ").zip(field("data: "));
                self.buffer = rest.to_owned();
                if let Some((name, data)) = found {
                    return (name, serde_json::from_str(&data).expect("data is JSON"));
                }
                continue;
            }
            let mut size = String::new();
            self.reader.read_line(&mut size).expect("there is a chunk");
            let size = usize::from_str_radix(size.trim(), 16).expect("chunks have sizes");
            let mut chunk = vec![0; size + 2];
            self.reader.read_exact(&mut chunk).expect("chunks are as long as announced");
            self.buffer += std::str::from_utf8(&chunk[..size]).expect("events are text");
        }
    }

    /// The next event of a name with something about it.
    pub fn wait(&mut self, wanted: &str, is_wanted: impl Fn(&serde_json::Value) -> bool) -> serde_json::Value {
        loop {
            let (name, data) = self.next();
            if name == wanted && is_wanted(&data) {
                return data;
            }
        }
    }
}
