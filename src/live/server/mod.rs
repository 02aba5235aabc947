//! The page's server: HTTP on one thread, for a browser on this machine.
//!
//! Everything lies below a random token in the path; nothing is served but the page, events, pictures and answers:
//!
//! | request | answer |
//! |---|---|
//! | `GET /TOKEN/` | the page |
//! | `GET /TOKEN/events` | what is new, as server-sent events, each topic's newest state only |
//! | `GET /TOKEN/picture?have=N&exposure=E` | the part of the picture that changed since revision N, as bytes |
//! | `GET /TOKEN/why?x=X&y=Y` | why there is a line at a place, or why not |
//! | `POST /TOKEN/edit`, `revert`, `layer`, `save` | changes what is shown, or the scene file |
//!
//! Built on hyper, whose connections can be given limits of header size and time; a router or WebSockets would bring
//! more code than these few lines. Events only say that there is a picture, and the page fetches it when it has time: so a
//! slow page skips pictures instead of queueing them.

pub(super) mod messages;
mod security;

use std::convert::Infallible;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use bytes::Bytes;
use http_body_util::channel::Channel;
use http_body_util::{BodyExt, Either, Full, Limited};
use hyper::body::{Body, Incoming};
use hyper::header::{CACHE_CONTROL, CONNECTION, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HeaderName, HeaderValue};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use serde::de::DeserializeOwned;
use serde_json::json;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, oneshot};
use tokio_io_timeout::TimeoutStream;

use super::Session;
use super::board::{Board, Read};
use super::watch::{Command, WatchHandle};
use crate::diag::Diagnostic;
use crate::render::why::why;
use security::{Gate, Refusal};

/// Where the page is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PageOptions {
    /// The address to listen at; loopback unless others are to reach it.
    pub host: IpAddr,
    /// The port; 0 for any that is free.
    pub port: u16,
}

impl PageOptions {
    /// Only this machine, at any port that is free.
    pub const LOCAL: Self = Self { host: IpAddr::V4(std::net::Ipv4Addr::LOCALHOST), port: 0 };
}

/// Most connections at a time; more wait.
const MOST_CONNECTIONS: usize = 64;
/// Most bytes of a request's head, and of its body.
const MOST_HEAD: usize = 16 << 10;
const MOST_BODY: usize = 64 << 10;
const MOST_HEADERS: usize = 64;
/// How long a client may take to send a request's head, its body, or to take in a piece of an answer.
const PATIENCE: Duration = Duration::from_secs(10);
/// How often a stream of events shows that it still stands.
const HEARTBEAT: Duration = Duration::from_secs(15);

/// A running server; dropping it ends it.
pub(super) struct Server {
    url: String,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    pub fn start(
        options: &PageOptions,
        board: Arc<Board>,
        session: Arc<Session>,
        watch: WatchHandle,
    ) -> Result<Self, Diagnostic> {
        let asked = SocketAddr::new(options.host, options.port);
        let cannot = |error: &dyn std::fmt::Display| {
            let fault = Diagnostic::error(format!("cannot serve the page at {asked}: {error}"));
            fault.hint("choose another port with --port, or 0 for any that is free")
        };
        let listener = std::net::TcpListener::bind(asked).map_err(|error| cannot(&error))?;
        listener.set_nonblocking(true).map_err(|error| cannot(&error))?;
        let address = listener.local_addr().map_err(|error| cannot(&error))?;
        let gate = Gate::new(address).map_err(|error| cannot(&error))?;
        let url = format!("http://{address}/{}/", gate.token);
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_io()
            .enable_time()
            // Pictures are converted and lines explained beside the connections.
            .max_blocking_threads(4)
            .build()
            .map_err(|error| cannot(&error))?;
        let service = Arc::new(Service { gate, board, session, watch, explaining: Semaphore::new(1) });
        let (stop, stopped) = oneshot::channel();
        let work = move || {
            runtime.block_on(async {
                // Registering it cannot fail in a running runtime.
                if let Ok(listener) = TcpListener::from_std(listener) {
                    tokio::select! {
                        () = accept(listener, service) => {}
                        _ = stopped => {}
                    }
                }
            });
            runtime.shutdown_timeout(Duration::from_secs(2));
        };
        let thread = std::thread::Builder::new().name("page".into()).spawn(work).map_err(|error| cannot(&error))?;
        Ok(Self { url, stop: Some(stop), thread: Some(thread) })
    }

    pub fn url(&self) -> &str {
        &self.url
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        if let Some(stop) = self.stop.take() {
            let _ = stop.send(());
        }
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

async fn accept(listener: TcpListener, service: Arc<Service>) {
    let room = Arc::new(Semaphore::new(MOST_CONNECTIONS));
    loop {
        // The semaphore is never closed.
        let Ok(place) = Arc::clone(&room).acquire_owned().await else { return };
        match listener.accept().await {
            Ok((stream, _)) => {
                let service = Arc::clone(&service);
                tokio::spawn(async move {
                    serve(stream, service).await;
                    drop(place);
                });
            }
            // The client is gone already, or the process has no file left to open: that passes.
            Err(_) => tokio::time::sleep(Duration::from_millis(50)).await,
        }
    }
}

/// Serves a connection until it ends. Whatever goes wrong with it concerns its client only.
async fn serve(stream: TcpStream, service: Arc<Service>) {
    // Without it, small answers would wait for more to come.
    let _ = stream.set_nodelay(true);
    let mut stream = TimeoutStream::new(stream);
    stream.set_write_timeout(Some(PATIENCE));
    let answer = service_fn(move |request| {
        let service = Arc::clone(&service);
        async move { Ok::<_, Infallible>(service.answer(request).await) }
    });
    let _ = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(PATIENCE)
        .max_buf_size(MOST_HEAD)
        .max_headers(MOST_HEADERS)
        .serve_connection(TokioIo::new(Box::pin(stream)), answer)
        .await;
}

type Answer = Response<Either<Full<Bytes>, Channel<Bytes>>>;

struct Service {
    gate: Gate,
    board: Arc<Board>,
    session: Arc<Session>,
    watch: WatchHandle,
    /// Explanations take all cores for a while: one at a time.
    explaining: Semaphore,
}

const PAGE: &str = include_str!("../page.html");
/// Where the page's text has the nonce that its scripts and styles need.
const NONCE: &str = "NONCE";
const HTML: &str = "text/html; charset=utf-8";
const JSON: &str = "application/json";
const BYTES: &str = "application/octet-stream";
const EVENTS: &str = "text/event-stream";

impl Service {
    async fn answer(&self, request: Request<Incoming>) -> Answer {
        let (head, body) = request.into_parts();
        let path = head.uri.path();
        let query = Query(head.uri.query().unwrap_or(""));
        let route = match self.gate.admit(&head.method, path, &head.headers) {
            Ok(route) => route,
            Err(Refusal { status, why }) => return closing(refused(status, why)),
        };
        let is_get = head.method == Method::GET;
        if is_get && !body.is_end_stream() {
            return closing(refused(StatusCode::BAD_REQUEST, "a GET has no body"));
        }
        match (is_get, route) {
            (true, "") => self.page(),
            (true, "events") => self.events(),
            (true, "picture") => self.picture(&query).await,
            (true, "why") => self.why(&query).await,
            (false, "edit" | "revert" | "layer" | "save") => self.command(route, body).await,
            _ => closing(refused(StatusCode::NOT_FOUND, "nothing is here")),
        }
    }

    fn page(&self) -> Answer {
        let mut bytes = [0; 16];
        if getrandom::fill(&mut bytes).is_err() {
            return refused(StatusCode::INTERNAL_SERVER_ERROR, "the system gives no random numbers");
        }
        let nonce: String = bytes.map(|byte| format!("{byte:02x}")).concat();
        let mut answer = full(StatusCode::OK, HTML, PAGE.replace(NONCE, &nonce));
        let policy = format!(
            "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; connect-src 'self'; img-src data:; \
             base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        );
        if let Ok(policy) = HeaderValue::try_from(policy) {
            answer.headers_mut().insert(CONTENT_SECURITY_POLICY, policy);
        }
        answer
    }

    fn events(&self) -> Answer {
        let (mut sender, body) = Channel::new(1);
        let board = Arc::clone(&self.board);
        tokio::spawn(async move {
            let mut versions = board.listen();
            let mut read = Read::default();
            loop {
                let mut text = String::new();
                for (topic, data) in board.news(&mut read) {
                    text += &format!("event: {}\ndata: {data}\n\n", topic.name());
                }
                if !text.is_empty() && sender.send_data(text.into()).await.is_err() {
                    return;
                }
                match tokio::time::timeout(HEARTBEAT, versions.changed()).await {
                    Ok(Ok(())) => {}
                    // The board is gone.
                    Ok(Err(_)) => return,
                    Err(_) if sender.send_data(":\n\n".into()).await.is_err() => return,
                    Err(_) => {}
                }
            }
        });
        respond(StatusCode::OK, EVENTS, Either::Right(body))
    }

    async fn picture(&self, query: &Query<'_>) -> Answer {
        let have = query.number("have").unwrap_or(0);
        let exposure = query.number::<f32>("exposure").filter(|stops| stops.abs() <= 32.0).unwrap_or(0.0);
        let Some((shown, part)) = self.board.picture_since(have) else {
            return refused(StatusCode::NOT_FOUND, "there is no picture yet");
        };
        let pixels = tokio::task::spawn_blocking(move || messages::pixels(&shown, part, exposure)).await;
        match pixels {
            Ok(Some(pixels)) => respond(StatusCode::OK, BYTES, Either::Left(Full::new(pixels))),
            _ => refused(StatusCode::INTERNAL_SERVER_ERROR, "the picture does not have its layer"),
        }
    }

    async fn why(&self, query: &Query<'_>) -> Answer {
        let (Some(x), Some(y)) = (query.number::<f32>("x"), query.number::<f32>("y")) else {
            return refused(StatusCode::BAD_REQUEST, "x and y are places in pixels");
        };
        let Ok(_turn) = self.explaining.acquire().await else {
            return refused(StatusCode::SERVICE_UNAVAILABLE, "the server is ending");
        };
        let Some(setup) = self.session.setup() else {
            return refused(StatusCode::NOT_FOUND, "there is no scene yet");
        };
        let explained =
            tokio::task::spawn_blocking(move || why(&setup.scene, &setup.shaders, [x, y]).map(|(found, _)| found))
                .await;
        match explained {
            Ok(Ok(found)) => {
                let text = found.to_string();
                full(StatusCode::OK, JSON, json!({ "text": text, "found": found }).to_string())
            }
            Ok(Err(fault)) => full(StatusCode::BAD_REQUEST, JSON, json!({ "error": fault.to_string() }).to_string()),
            Err(_) => refused(StatusCode::INTERNAL_SERVER_ERROR, "the explanation failed"),
        }
    }

    async fn command(&self, route: &str, body: Incoming) -> Answer {
        let body = match tokio::time::timeout(PATIENCE, Limited::new(body, MOST_BODY).collect()).await {
            Ok(Ok(body)) => body.to_bytes(),
            Ok(Err(_)) => return closing(refused(StatusCode::PAYLOAD_TOO_LARGE, "the request is broken or too long")),
            Err(_) => return closing(refused(StatusCode::REQUEST_TIMEOUT, "the request took too long")),
        };
        let command = match route {
            "edit" => parse(&body).map(|messages::EditRequest { edits }| {
                Command::Edit(edits.into_iter().map(|edit| (edit.path, edit.value)).collect())
            }),
            "revert" => parse(&body).map(|messages::RevertRequest { paths }| Command::Revert(paths)),
            "layer" => parse(&body).map(|messages::LayerRequest { layer }| Command::Layer(layer)),
            _ => return self.save().await,
        };
        match command {
            Ok(command) => {
                self.watch.send(command);
                full(StatusCode::NO_CONTENT, JSON, "")
            }
            Err(fault) => full(StatusCode::BAD_REQUEST, JSON, json!({ "error": fault }).to_string()),
        }
    }

    async fn save(&self) -> Answer {
        let (reply, result) = oneshot::channel();
        self.watch.send(Command::Save(reply));
        match result.await {
            Ok(Ok(())) => full(StatusCode::NO_CONTENT, JSON, ""),
            Ok(Err(faults)) => full(StatusCode::CONFLICT, JSON, json!({ "error": faults.to_string() }).to_string()),
            Err(_) => refused(StatusCode::SERVICE_UNAVAILABLE, "watching has ended"),
        }
    }
}

fn parse<T: DeserializeOwned>(body: &Bytes) -> Result<T, String> {
    serde_json::from_slice(body).map_err(|error| error.to_string())
}

/// The part of an address after `?`.
struct Query<'a>(&'a str);

impl Query<'_> {
    fn number<T: std::str::FromStr>(&self, name: &str) -> Option<T> {
        let pairs = self.0.split('&').filter_map(|pair| pair.split_once('='));
        pairs.into_iter().find(|(known, _)| *known == name)?.1.parse().ok()
    }
}

fn respond(status: StatusCode, kind: &'static str, body: Either<Full<Bytes>, Channel<Bytes>>) -> Answer {
    let mut answer = Response::new(body);
    *answer.status_mut() = status;
    let headers = answer.headers_mut();
    for (name, value) in [
        (CONTENT_TYPE, kind),
        (CACHE_CONTROL, "no-store"),
        (HeaderName::from_static("x-content-type-options"), "nosniff"),
        (HeaderName::from_static("x-frame-options"), "DENY"),
        // The address holds the token.
        (HeaderName::from_static("referrer-policy"), "no-referrer"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
        (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    answer
}

fn full(status: StatusCode, kind: &'static str, body: impl Into<Bytes>) -> Answer {
    respond(status, kind, Either::Left(Full::new(body.into())))
}

fn refused(status: StatusCode, why: &'static str) -> Answer {
    full(status, "text/plain; charset=utf-8", format!("{why}\n"))
}

/// The same, and the connection ends after it.
fn closing(mut answer: Answer) -> Answer {
    answer.headers_mut().insert(CONNECTION, HeaderValue::from_static("close"));
    answer
}
