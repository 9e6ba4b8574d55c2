//! API keys: who may ask.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::RwLock;
use std::time::SystemTime;

use axum::http::{HeaderMap, HeaderValue, header};
use sha2::{Digest, Sha256};
use subtle::{Choice, ConstantTimeEq};

/// The hash of a key: of one length, so that comparing tells nothing about the key.
type Hash = [u8; 32];

/// The keys, from the setting and from the file.
#[derive(Debug, Default)]
pub struct Keys {
    given: Vec<Hash>,
    file: Option<PathBuf>,
    of_file: RwLock<OfFile>,
}

#[derive(Debug, Default)]
struct OfFile {
    hashes: Vec<Hash>,
    stamp: Option<Stamp>,
}

/// What changes when a file changes.
type Stamp = (SystemTime, u64);

impl Keys {
    /// The keys given, and those of the file.
    ///
    /// # Errors
    /// A key that no header can carry; a file that cannot be read or has no key.
    pub fn new(given: &[String], file: Option<PathBuf>) -> Result<Self, String> {
        let given = given.iter().map(|key| checked(key)).collect::<Result<_, _>>()?;
        let keys = Keys { given, file, of_file: RwLock::default() };
        keys.reload()?;
        Ok(keys)
    }

    /// Whether a key is needed at all.
    pub fn are_required(&self) -> bool {
        self.file.is_some() || !self.given.is_empty()
    }

    /// Reads the file again if it has changed; says whether it had.
    ///
    /// # Errors
    /// As [`Keys::new`]; the keys stay as they were.
    pub fn reload(&self) -> Result<bool, String> {
        let Some(path) = &self.file else { return Ok(false) };
        let stamp = stamp(path)
            .map_err(|error| format!("the API keys file {}: {error}", path.display()))?;
        if self.of_file.read().is_ok_and(|known| known.stamp == Some(stamp)) {
            return Ok(false);
        }
        let hashes =
            read(path).map_err(|error| format!("the API keys file {}: {error}", path.display()))?;
        let mut of_file = self.of_file.write().unwrap_or_else(std::sync::PoisonError::into_inner);
        *of_file = OfFile { hashes, stamp: Some(stamp) };
        Ok(true)
    }

    /// Whether these headers carry a key, as `Authorization: Bearer` or as `X-Api-Key`.
    pub fn admit(&self, headers: &HeaderMap) -> bool {
        let bearer = headers.get(header::AUTHORIZATION).and_then(|value| token(value.as_bytes()));
        let plain = headers.get("x-api-key").map(HeaderValue::as_bytes);
        bearer.into_iter().chain(plain).any(|key| self.knows(key))
    }

    /// Compares with every key, whichever fits.
    fn knows(&self, key: &[u8]) -> bool {
        let hash: Hash = Sha256::digest(key).into();
        let of_file = self.of_file.read().unwrap_or_else(std::sync::PoisonError::into_inner);
        let compare = |found: Choice, known: &Hash| found | known.ct_eq(&hash);
        self.given.iter().chain(&of_file.hashes).fold(Choice::from(0), compare).into()
    }
}

/// What follows `Bearer`, in any case (RFC 9110 section 11.1).
fn token(value: &[u8]) -> Option<&[u8]> {
    let (scheme, token) = value.split_at_checked(7)?;
    scheme.eq_ignore_ascii_case(b"bearer ").then(|| token.trim_ascii())
}

fn stamp(path: &Path) -> std::io::Result<Stamp> {
    let about = fs::metadata(path)?;
    Ok((about.modified()?, about.len()))
}

fn read(path: &Path) -> Result<Vec<Hash>, String> {
    let text = fs::read_to_string(path).map_err(|error| error.to_string())?;
    let keys =
        text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let hashes: Vec<Hash> = keys.map(checked).collect::<Result<_, _>>()?;
    if hashes.is_empty() { Err("it has no key; write one a line".into()) } else { Ok(hashes) }
}

fn checked(key: &str) -> Result<Hash, String> {
    if key.is_empty() || !key.bytes().all(|byte| byte.is_ascii_graphic()) {
        return Err("an API key is empty or has characters other than visible ASCII".into());
    }
    Ok(Sha256::digest(key.as_bytes()).into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(name: &'static str, value: &str) -> HeaderMap {
        HeaderMap::from_iter([(name.parse().unwrap(), value.parse().unwrap())])
    }

    #[test]
    fn either_header_and_any_key_will_do() {
        let keys = Keys::new(&["one".into(), "two".into()], None).unwrap();
        assert!(keys.are_required());
        for (name, value) in [
            ("authorization", "Bearer one"),
            ("authorization", "bearer  two"),
            ("x-api-key", "two"),
        ] {
            assert!(keys.admit(&headers(name, value)), "{name}: {value}");
        }
        for (name, value) in [
            ("authorization", "one"),
            ("authorization", "Basic one"),
            ("x-api-key", "three"),
            ("x-api-key", ""),
            ("cookie", "one"),
        ] {
            assert!(!keys.admit(&headers(name, value)), "{name}: {value}");
        }
        assert!(!keys.admit(&HeaderMap::new()));
    }

    #[test]
    fn keys_that_no_header_can_carry_are_refused() {
        assert!(Keys::new(&["a b".into()], None).is_err());
        assert!(Keys::new(&[String::new()], None).is_err());
        assert!(Keys::new(&[], Some("/no/such/file".into())).is_err());
        assert!(!Keys::new(&[], None).unwrap().are_required());
    }
}
