//! Which connections are accepted: rules that keep web pages out, and an optional token.
//!
//! A browser lets any page open a websocket to any address, so that a page of another site could use a server on the
//! user's machine. Browsers state the page's site in `Origin`, and the name that the page used in `Host`, also if the
//! owner of that name has pointed it to the local machine (DNS rebinding).

use std::net::{IpAddr, SocketAddr};

use tungstenite::{
    handshake::server::Request,
    http::{HeaderMap, StatusCode, Uri, header},
};

use super::http::Refusal;

#[derive(Clone, Debug)]
pub struct AccessRules {
    /// Name or address as given by the user.
    host: String,
    address: IpAddr,
    token: Option<String>,
}

impl AccessRules {
    /// Rules of a server that listens on `address`, which the user named `host`.
    pub fn new(host: &str, address: SocketAddr, token: Option<String>) -> Self {
        let host = host.trim_start_matches('[').trim_end_matches(']').to_ascii_lowercase();
        Self { host, address: address.ip(), token }
    }

    /// Checks the headers of a request.
    ///
    /// # Errors
    /// It comes from a page of another site, names another server, or lacks the token.
    pub fn check(&self, request: &Request) -> Result<(), Refusal> {
        let headers = request.headers();
        let host = text(headers, &header::HOST).unwrap_or_default();
        // Programs send no origin, or the server's own.
        if headers.contains_key(header::ORIGIN) && !is_same_site(headers, &host) {
            let origin = text(headers, &header::ORIGIN).unwrap_or_default();
            return Err(Refusal::new(
                StatusCode::FORBIDDEN,
                format!("connections of web pages are refused (Origin: {origin})\n"),
            ));
        }
        match &self.token {
            Some(token) if !is_authorized(headers, token) => Err(Refusal::new(
                StatusCode::UNAUTHORIZED,
                "the server requires its token in the header Authorization: Bearer TOKEN\n",
            )),
            // No web page knows the token.
            Some(_) => Ok(()),
            None if self.is_own_name(&host) => Ok(()),
            None => Err(Refusal::new(
                StatusCode::FORBIDDEN,
                format!(
                    "Host: {host} is not an address of this server; connect to its IP address, or start it with that \
                     name as its host, or with a token\n"
                ),
            )),
        }
    }

    /// True if the value of a header `Host` names this server. The port is not compared, since a tunnel may change it.
    fn is_own_name(&self, host: &str) -> bool {
        // A Host header has no user (RFC 9110, 7.2).
        if host.contains('@') {
            return false;
        }
        let Some(name) = host.parse::<Uri>().ok().and_then(|uri| uri.host().map(str::to_ascii_lowercase))
        else {
            return false;
        };
        let name = name.trim_start_matches('[').trim_end_matches(']');
        match name.parse::<IpAddr>() {
            // Only names can be pointed to another address.
            Ok(_) if self.address.is_unspecified() => true,
            Ok(ip) if self.address.is_loopback() => ip.is_loopback(),
            Ok(ip) => ip == self.address,
            Err(_) => {
                let is_local = self.address.is_unspecified() || self.address.is_loopback();
                name == self.host || (name == "localhost" && is_local)
            }
        }
    }
}

fn text(headers: &HeaderMap, name: &header::HeaderName) -> Option<String> {
    headers.get(name).map(|value| String::from_utf8_lossy(value.as_bytes()).into_owned())
}

/// True if the origin is a page of the server itself, as some client libraries state.
fn is_same_site(headers: &HeaderMap, host: &str) -> bool {
    let origins: Vec<_> = headers.get_all(header::ORIGIN).iter().collect();
    let [origin] = origins[..] else { return false };
    let origin = String::from_utf8_lossy(origin.as_bytes()).to_ascii_lowercase();
    let authority = origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://"));
    authority == Some(host.to_ascii_lowercase().as_str())
}

fn is_authorized(headers: &HeaderMap, token: &str) -> bool {
    let expected = format!("Bearer {token}");
    headers
        .get(header::AUTHORIZATION)
        .is_some_and(|value| is_same_secret(value.as_bytes(), expected.as_bytes()))
}

/// Compares two secrets. The time does not depend on the first difference.
pub fn is_same_secret(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |bits, (a, b)| bits | (a ^ b)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(rules: &AccessRules, headers: &[(&str, &str)]) -> u16 {
        let mut request = Request::builder();
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        rules.check(&request.body(()).unwrap()).map_or_else(|refusal| refusal.status.as_u16(), |()| 200)
    }

    fn rules(host: &str, address: &str, token: Option<&str>) -> AccessRules {
        AccessRules::new(host, format!("{address}:8765").parse().unwrap(), token.map(str::to_owned))
    }

    #[test]
    fn the_host_names_the_address_of_the_server() {
        let local = rules("127.0.0.1", "127.0.0.1", None);
        for host in ["127.0.0.1:8765", "localhost:9000", "LOCALHOST", "[::1]:8765", "127.0.0.5"] {
            assert_eq!(status(&local, &[("Host", host)]), 200, "{host}");
        }
        for host in [
            "user@127.0.0.1",
            "@127.0.0.1:8765",
            "evil.example:8765",
            "192.0.2.1:8765",
            "localhost.evil.example",
            "",
            "0.0.0.0:8765",
        ] {
            assert_eq!(status(&local, &[("Host", host)]), 403, "{host}");
        }
        assert_eq!(status(&local, &[]), 403);
        let any = rules("0.0.0.0", "0.0.0.0", None);
        for (host, expected) in
            [("192.0.2.1:8765", 200), ("0.0.0.0:8765", 200), ("localhost", 200), ("robot.lab:8765", 403)]
        {
            assert_eq!(status(&any, &[("Host", host)]), expected, "{host}");
        }
        let named = rules("Robot.Lab", "192.0.2.1", None);
        for (host, expected) in [("robot.lab:8765", 200), ("192.0.2.1", 200), ("localhost", 403)] {
            assert_eq!(status(&named, &[("Host", host)]), expected, "{host}");
        }
    }

    #[test]
    fn web_pages_are_refused() {
        let local = rules("127.0.0.1", "127.0.0.1", None);
        for (origin, expected) in [
            ("https://evil.example", 403),
            ("null", 403),
            ("file://", 403),
            ("http://localhost:3000", 403),
            ("http://localhost:8765.evil.example", 403),
            ("http://localhost:8765", 200),
        ] {
            let headers = [("Host", "localhost:8765"), ("Origin", origin)];
            assert_eq!(status(&local, &headers), expected, "{origin}");
        }
        let twice =
            [("Host", "localhost"), ("Origin", "http://localhost"), ("Origin", "http://evil.example")];
        assert_eq!(status(&local, &twice), 403);
        // A name of the attacker that points to this machine.
        let rebound = [("Host", "evil.example"), ("Origin", "http://evil.example")];
        assert_eq!(status(&local, &rebound), 403);
    }

    #[test]
    fn a_token_replaces_the_check_of_the_host() {
        let rules = rules("0.0.0.0", "0.0.0.0", Some("s3cret"));
        let host = ("Host", "softvt:8765");
        assert_eq!(status(&rules, &[host]), 401);
        for (value, expected) in
            [("Bearer s3cret", 200), ("Bearer s3cre", 401), ("Bearer s3cret2", 401), ("s3cret", 401)]
        {
            assert_eq!(status(&rules, &[host, ("Authorization", value)]), expected, "{value}");
        }
        let page = [host, ("Authorization", "Bearer s3cret"), ("Origin", "http://evil.example")];
        assert_eq!(status(&rules, &page), 403);
    }
}
