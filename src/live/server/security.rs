//! Who may talk to the page's server.
//!
//! Whoever knows the token may do everything; the rest of the checks keep a browser from being made to use it for somebody
//! else. A page of another origin cannot read answers (no CORS header is ever sent) nor change anything (its `Origin` is
//! refused), and a name that leads to this machine only since a moment ago (DNS rebinding) is refused as `Host`.

use std::net::{IpAddr, SocketAddr};

use hyper::header::{CONTENT_TYPE, HOST, ORIGIN};
use hyper::{HeaderMap, Method, StatusCode};

/// What the server demands of every request.
#[derive(Clone, Debug)]
pub(super) struct Gate {
    /// The first part of every path.
    pub token: String,
    /// Where the server listens.
    pub address: SocketAddr,
}

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Refusal {
    pub status: StatusCode,
    /// A sentence for whoever looks.
    pub why: &'static str,
}

const fn refuse(status: StatusCode, why: &'static str) -> Refusal {
    Refusal { status, why }
}

/// Bytes of randomness in a token.
const TOKEN_BYTES: usize = 16;

impl Gate {
    /// A gate with a new token.
    pub fn new(address: SocketAddr) -> Result<Self, getrandom::Error> {
        let mut bytes = [0; TOKEN_BYTES];
        getrandom::fill(&mut bytes)?;
        Ok(Self { token: bytes.map(|byte| format!("{byte:02x}")).concat(), address })
    }

    /// The part of a request's path after the token, if the request may come in.
    pub fn admit<'a>(&self, method: &Method, path: &'a str, headers: &HeaderMap) -> Result<&'a str, Refusal> {
        let host = one(headers, HOST.as_str())?.ok_or(refuse(StatusCode::BAD_REQUEST, "a Host header is missing"))?;
        if !self.is_own_host(host) {
            return Err(refuse(StatusCode::FORBIDDEN, "this server goes by its IP address or localhost only"));
        }
        let foreign = refuse(StatusCode::FORBIDDEN, "requests of other origins are refused");
        match one(headers, ORIGIN.as_str())? {
            Some(origin) if origin.strip_prefix("http://") != Some(host) => return Err(foreign),
            _ => {}
        }
        // Browsers say where a request comes from; `none` is the address bar.
        let site = one(headers, "sec-fetch-site")?;
        if site.is_some_and(|site| !matches!(site, "same-origin" | "none")) {
            // A link on another page may open this one, and nothing more.
            let is_opened = *method == Method::GET && one(headers, "sec-fetch-mode")? == Some("navigate");
            if !is_opened || one(headers, "sec-fetch-dest")? != Some("document") {
                return Err(foreign);
            }
        }
        let route = self.after_token(path).ok_or(refuse(StatusCode::NOT_FOUND, "nothing is here without the token"))?;
        match *method {
            Method::GET => Ok(route),
            Method::POST if one(headers, CONTENT_TYPE.as_str())? == Some("application/json") => Ok(route),
            Method::POST => Err(refuse(StatusCode::UNSUPPORTED_MEDIA_TYPE, "send application/json")),
            _ => Err(refuse(StatusCode::METHOD_NOT_ALLOWED, "only GET and POST are known")),
        }
    }

    /// Whether a `Host` header names this server by a name that nobody else can lead here.
    fn is_own_host(&self, host: &str) -> bool {
        let (name, port) = match host.rsplit_once(':') {
            // The colons of an IPv6 address stand in brackets.
            Some((name, port)) if !port.contains(']') => (name, port.parse().ok()),
            _ => (host, Some(80)),
        };
        if port != Some(self.address.port()) {
            return false;
        }
        let bare = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
        match bare.parse::<IpAddr>() {
            Ok(ip) => ip == self.address.ip() || self.address.ip().is_unspecified() || ip.is_loopback(),
            Err(_) => name.eq_ignore_ascii_case("localhost"),
        }
    }

    fn after_token<'a>(&self, path: &'a str) -> Option<&'a str> {
        let path = path.strip_prefix('/')?;
        let (token, route) = path.split_once('/')?;
        // The time that this takes tells nothing of where the first wrong byte is.
        let differs = token.bytes().zip(self.token.bytes()).fold(0, |differs, (a, b)| differs | (a ^ b));
        (token.len() == self.token.len() && differs == 0).then_some(route)
    }
}

/// The value of a header that may be there once.
fn one<'a>(headers: &'a HeaderMap, name: &str) -> Result<Option<&'a str>, Refusal> {
    let bad = refuse(StatusCode::BAD_REQUEST, "a header is there twice or is no text");
    let mut values = headers.get_all(name).iter();
    let Some(value) = values.next() else { return Ok(None) };
    if values.next().is_some() {
        return Err(bad);
    }
    value.to_str().map(Some).map_err(|_| bad)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gate(address: &str) -> Gate {
        Gate { token: "5ec2e7".into(), address: address.parse().unwrap() }
    }

    fn admit(gate: &Gate, method: Method, path: &str, headers: &[(&str, &str)]) -> Result<String, u16> {
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            map.append(hyper::header::HeaderName::try_from(*name).unwrap(), value.parse().unwrap());
        }
        gate.admit(&method, path, &map).map(str::to_owned).map_err(|refusal| refusal.status.as_u16())
    }

    const OWN: (&str, &str) = ("host", "127.0.0.1:4321");

    #[test]
    fn the_token_opens() {
        let gate = gate("127.0.0.1:4321");
        assert_eq!(admit(&gate, Method::GET, "/5ec2e7/", &[OWN]), Ok(String::new()));
        assert_eq!(admit(&gate, Method::GET, "/5ec2e7/events", &[OWN]), Ok("events".to_owned()));
        for path in ["/", "/5ec2e7", "/5ec2e8/", "/5ec2e7x/", "/5ec2e/", "//", "", "/../5ec2e7/", "/%35ec2e7/", "*"] {
            assert_eq!(admit(&gate, Method::GET, path, &[OWN]), Err(404), "{path}");
        }
    }

    #[test]
    fn names_that_can_be_led_here_are_refused() {
        let local = gate("127.0.0.1:4321");
        for host in ["localhost:4321", "LOCALHOST:4321", "127.0.0.1:4321", "[::1]:4321"] {
            assert!(admit(&local, Method::GET, "/5ec2e7/", &[("host", host)]).is_ok(), "{host}");
        }
        for host in [
            "evil.example:4321",
            "127.0.0.1",
            "127.0.0.1:4322",
            "localhost.evil.example:4321",
            "10.0.0.1:4321",
            "",
            ":4321",
        ] {
            assert_eq!(admit(&local, Method::GET, "/5ec2e7/", &[("host", host)]), Err(403), "{host}");
        }
        assert_eq!(admit(&local, Method::GET, "/5ec2e7/", &[]), Err(400));
        assert_eq!(admit(&local, Method::GET, "/5ec2e7/", &[OWN, OWN]), Err(400));
        let open = gate("0.0.0.0:4321");
        assert!(admit(&open, Method::GET, "/5ec2e7/", &[("host", "10.0.0.1:4321")]).is_ok());
        assert_eq!(admit(&open, Method::GET, "/5ec2e7/", &[("host", "studio:4321")]), Err(403));
    }

    #[test]
    fn other_origins_are_refused() {
        let gate = gate("127.0.0.1:4321");
        let json = ("content-type", "application/json");
        let post = |headers: &[(&str, &str)]| admit(&gate, Method::POST, "/5ec2e7/edit", headers);
        assert!(post(&[OWN, json]).is_ok());
        assert!(post(&[OWN, json, ("origin", "http://127.0.0.1:4321"), ("sec-fetch-site", "same-origin")]).is_ok());
        for origin in
            ["http://evil.example", "null", "http://127.0.0.1:9", "https://127.0.0.1:4321", "http://localhost:4321"]
        {
            assert_eq!(post(&[OWN, json, ("origin", origin)]), Err(403), "{origin}");
        }
        assert_eq!(post(&[OWN, json, ("sec-fetch-site", "cross-site")]), Err(403));
        assert_eq!(post(&[OWN, json, ("sec-fetch-site", "same-site")]), Err(403));
        assert_eq!(post(&[OWN]), Err(415));
        assert_eq!(post(&[OWN, ("content-type", "text/plain")]), Err(415));
        assert_eq!(admit(&gate, Method::PUT, "/5ec2e7/edit", &[OWN, json]), Err(405));
        // A link may open the page, but no picture may be put into another page.
        let from_elsewhere = |mode, dest| {
            let headers = [OWN, ("sec-fetch-site", "cross-site"), ("sec-fetch-mode", mode), ("sec-fetch-dest", dest)];
            admit(&gate, Method::GET, "/5ec2e7/", &headers)
        };
        assert!(from_elsewhere("navigate", "document").is_ok());
        assert_eq!(from_elsewhere("navigate", "iframe"), Err(403));
        assert_eq!(from_elsewhere("no-cors", "image"), Err(403));
    }

    #[test]
    fn tokens_are_long_and_differ() {
        let address = "127.0.0.1:1".parse().unwrap();
        let [a, b] = [Gate::new(address).unwrap().token, Gate::new(address).unwrap().token];
        assert_eq!((a.len(), b.len()), (2 * TOKEN_BYTES, 2 * TOKEN_BYTES));
        assert_ne!(a, b);
    }
}
