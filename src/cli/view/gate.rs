//! Access control: a token in the address, a `Host` that a foreign name cannot forge, an `Origin` that is this page's own.

use std::net::{IpAddr, SocketAddr};

use rand::TryRng as _;

/// Length of a token: 128 bits in hexadecimal.
const TOKEN_LETTERS: usize = 32;

/// The requirements of a request.
#[derive(Debug)]
pub struct Gate {
    token: String,
}

/// Why a request is refused: the status and a sentence for the sender.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Refusal(pub &'static str, pub &'static str);

/// Unguessable random letters, from the system's source.
fn token() -> std::io::Result<String> {
    let mut bytes = [0_u8; TOKEN_LETTERS / 2];
    rand::rngs::SysRng
        .try_fill_bytes(&mut bytes)
        .map_err(std::io::Error::other)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

impl Gate {
    /// A gate with a new token.
    ///
    /// # Errors
    /// If the system has no random numbers.
    pub fn new() -> std::io::Result<Self> {
        Ok(Self { token: token()? })
    }

    /// The address to open.
    pub fn address(&self, at: SocketAddr) -> String {
        format!("http://{at}/{}/", self.token)
    }

    /// The part of a path after the token.
    ///
    /// # Errors
    /// A path without the token.
    pub fn inside<'a>(&self, path: &'a str) -> Result<&'a str, Refusal> {
        let rest = path.strip_prefix('/').unwrap_or_default();
        let (token, inside) = rest.split_once('/').unwrap_or((rest, ""));
        // Compare in constant time: every letter is examined.
        let differ = |(a, b): (u8, u8)| usize::from(a != b);
        let wrong: usize = token.bytes().zip(self.token.bytes()).map(differ).sum();
        if token.len() != self.token.len() || wrong != 0 {
            return Err(Refusal(
                "403 Forbidden",
                "open the whole address that `octolux view` printed",
            ));
        }
        Ok(inside)
    }

    /// Checks the name by which this server was called. Another site can make its own name resolve to this machine, but it
    /// cannot make a browser call this server by a number or by `localhost`.
    ///
    /// # Errors
    /// Any other name.
    pub fn host(&self, host: Option<&str>) -> Result<(), Refusal> {
        let known = host.is_some_and(|host| {
            let name = match host.rsplit_once(':') {
                Some((name, port)) if port.bytes().all(|b| b.is_ascii_digit()) => name,
                _ => host,
            };
            let number = name
                .strip_prefix('[')
                .and_then(|name| name.strip_suffix(']'))
                .unwrap_or(name);
            name.eq_ignore_ascii_case("localhost") || number.parse::<IpAddr>().is_ok()
        });
        if known {
            return Ok(());
        }
        Err(Refusal("403 Forbidden", "call this server localhost or by its number"))
    }

    /// Checks the origin of the request: the own page or, unless `needed`, none.
    ///
    /// # Errors
    /// A page of another origin.
    pub fn origin(&self, origin: Option<&str>, host: Option<&str>, needed: bool) -> Result<(), Refusal> {
        let own = match (origin, host) {
            (Some(origin), Some(host)) => origin
                .strip_prefix("http://")
                .is_some_and(|name| name.eq_ignore_ascii_case(host)),
            (Some(_), None) => false,
            (None, _) => !needed,
        };
        if own {
            return Ok(());
        }
        Err(Refusal("403 Forbidden", "only the page of this server may ask"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_others_may_own_are_refused() {
        let gate = Gate::new().unwrap();
        for good in ["localhost", "LocalHost:80", "127.0.0.1:9000", "[::1]:4", "10.1.2.3"] {
            assert_eq!(gate.host(Some(good)), Ok(()), "{good}");
        }
        for bad in [
            "evil.example",
            "localhost.evil.example:80",
            "127.0.0.1.evil.example",
            "",
            "localhost:80:90",
        ] {
            assert!(gate.host(Some(bad)).is_err(), "{bad}");
        }
        assert!(gate.host(None).is_err());
    }

    #[test]
    fn a_page_is_its_own_only_with_the_same_name_and_port() {
        let gate = Gate::new().unwrap();
        let host = Some("localhost:9000");
        assert_eq!(gate.origin(Some("http://localhost:9000"), host, true), Ok(()));
        for bad in [
            "http://localhost:9001",
            "https://localhost:9000",
            "null",
            "http://evil.example",
        ] {
            assert!(gate.origin(Some(bad), host, false).is_err(), "{bad}");
        }
        assert!(gate.origin(None, host, true).is_err());
        assert_eq!(gate.origin(None, host, false), Ok(()));
    }

    #[test]
    fn tokens_differ_and_are_needed_whole() {
        let (one, other) = (Gate::new().unwrap(), Gate::new().unwrap());
        assert_ne!(one.token, other.token);
        assert_eq!(one.token.len(), TOKEN_LETTERS);
        assert_eq!(one.inside(&format!("/{}/view.js", one.token)), Ok("view.js"));
        for bad in [
            "/",
            "/view.js",
            &format!("/{}", &one.token[1..]),
            &format!("/{}/", other.token),
        ] {
            assert!(one.inside(bad).is_err(), "{bad}");
        }
    }
}
