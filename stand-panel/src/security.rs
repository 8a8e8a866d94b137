//! Which requests the panel answers: the page can move a machine, and every site that a browser on this computer opens can send requests to
//! it.
//!
//! In: the head of a request. Out: accepted, or the status to refuse it with. A name other than loopback in `Host` is DNS rebinding;
//! another `Origin` is another site's page. Neither has the token, which is in the fragment of the address and so in no request, log or
//! referrer.

use axum::http::header::{AUTHORIZATION, CONTENT_SECURITY_POLICY, HOST, ORIGIN, UPGRADE, X_CONTENT_TYPE_OPTIONS};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, Uri};

const SEC_FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// What the page needs, and nothing else. Pictures of effects are SVG in `blob:` images, where no script runs.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Headers of every response.
pub const RESPONSE_HEADERS: [(HeaderName, &str); 6] = [
    (CONTENT_SECURITY_POLICY, POLICY),
    (X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (HeaderName::from_static("referrer-policy"), "no-referrer"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (HeaderName::from_static("cache-control"), "no-store"),
];

/// Secret of one run: whoever has it may use the panel.
#[derive(Clone)]
pub struct Token(String);

impl std::fmt::Debug for Token {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Token")
    }
}

impl Token {
    /// 256 bits of the operating system's generator.
    ///
    /// # Errors
    /// The system has no generator.
    pub fn random() -> Result<Self, std::io::Error> {
        let mut bytes = [0; 32];
        getrandom::fill(&mut bytes).map_err(|error| std::io::Error::other(error.to_string()))?;
        Ok(Token(bytes.iter().map(|byte| format!("{byte:02x}")).collect()))
    }

    /// The token in hexadecimal digits, for the address of the page.
    pub fn reveal(&self) -> &str {
        &self.0
    }

    /// Whether `given` is the token, in a time that does not depend on where they differ.
    pub fn is(&self, given: &[u8]) -> bool {
        given.len() == self.0.len() && self.0.bytes().zip(given).fold(0, |difference, (a, b)| difference | (a ^ b)) == 0
    }
}

/// The checks of one server.
#[derive(Debug, Clone)]
pub struct Gate {
    port: u16,
    token: Token,
}

impl Gate {
    /// For the server at this port of the loopback interface.
    pub fn new(port: u16, token: Token) -> Self {
        Gate { port, token }
    }

    /// The token.
    pub fn token(&self) -> &Token {
        &self.token
    }

    /// Checks addressee and sender of a request, before routing.
    ///
    /// # Errors
    /// The status to refuse it with.
    pub fn check(&self, method: &Method, uri: &Uri, headers: &HeaderMap) -> Result<(), StatusCode> {
        let host = only(headers, &HOST)?.ok_or(StatusCode::BAD_REQUEST)?;
        if !["127.0.0.1", "localhost"].iter().any(|name| host == format!("{name}:{}", self.port)) {
            return Err(StatusCode::MISDIRECTED_REQUEST);
        }
        // A request line with a whole address overrides the header (RFC 9112, 3.2.2).
        if uri.authority().is_some_and(|authority| authority.as_str() != host) {
            return Err(StatusCode::MISDIRECTED_REQUEST);
        }
        let is_upgrade = headers.contains_key(UPGRADE);
        let changes = *method != Method::GET && *method != Method::HEAD;
        match only(headers, &ORIGIN)? {
            Some(origin) if origin != format!("http://{host}") => return Err(StatusCode::FORBIDDEN),
            None if changes || is_upgrade => return Err(StatusCode::FORBIDDEN),
            _ => {}
        }
        match only(headers, &SEC_FETCH_SITE)? {
            None | Some("same-origin") => Ok(()),
            // A typed address or a bookmark.
            Some("none") if !changes && !is_upgrade => Ok(()),
            // A link from elsewhere opens the page, which is nothing without the token.
            Some(_) if !changes && !is_upgrade && uri.path() == "/" => Ok(()),
            Some(_) => Err(StatusCode::FORBIDDEN),
        }
    }

    /// Checks the token of a request for data.
    ///
    /// # Errors
    /// It is missing or wrong.
    pub fn check_token(&self, headers: &HeaderMap) -> Result<(), StatusCode> {
        let given = only(headers, &AUTHORIZATION)?.and_then(|value| value.strip_prefix("Bearer "));
        if given.is_some_and(|given| self.token.is(given.as_bytes())) { Ok(()) } else { Err(StatusCode::UNAUTHORIZED) }
    }
}

/// The only value of a header; `None`: the header is missing.
fn only<'h>(headers: &'h HeaderMap, name: &HeaderName) -> Result<Option<&'h str>, StatusCode> {
    let mut values = headers.get_all(name).iter();
    let first = values.next().map(HeaderValue::to_str).transpose().map_err(|_| StatusCode::BAD_REQUEST)?;
    if values.next().is_some() { Err(StatusCode::BAD_REQUEST) } else { Ok(first) }
}
