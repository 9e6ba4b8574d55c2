//! Which coding of its answers a client likes best.

use axum::http::{HeaderMap, HeaderValue, header};

use super::negotiate;

/// How the bytes of an answer are compressed on their way (RFC 9110 section 8.4.1, RFC 8878).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coding {
    /// Zstandard: the smaller text for a third of the work.
    Zstd,
    /// What every client knows.
    Gzip,
}

impl Coding {
    /// As `Content-Encoding` says it.
    pub fn header(self) -> HeaderValue {
        HeaderValue::from_static(match self {
            Coding::Zstd => "zstd",
            Coding::Gzip => "gzip",
        })
    }

    /// What `Accept-Encoding` likes best (RFC 9110 section 12.5.3); nothing: the answer as it is.
    ///
    /// Who says `*` gets gzip, as zstd is for those who name it. An answer is sent as it is to
    /// those who forbid that and take nothing on offer, as the RFC allows.
    pub fn wanted(headers: &HeaderMap) -> Option<Self> {
        let lists =
            headers.get_all(header::ACCEPT_ENCODING).iter().filter_map(|value| value.to_str().ok());
        let codings: Vec<(String, f64)> =
            lists.flat_map(|list| list.split(',')).map(negotiate::weighed).collect();
        let of = |names: &[&str]| {
            let named =
                names.iter().find_map(|name| codings.iter().find(|(known, _)| known == name));
            named.map_or(0.0, |(_, quality)| *quality)
        };
        let (zstd, gzip) = (of(&["zstd"]), of(&["gzip", "x-gzip", "*"]));
        // Unless it is named, whatever is named goes before.
        let plain = of(&["identity", "*"]);
        if zstd > 0.0 && zstd >= gzip.max(plain) {
            Some(Coding::Zstd)
        } else {
            (gzip > 0.0 && gzip >= plain).then_some(Coding::Gzip)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn choice(lists: &[&str]) -> Option<Coding> {
        let header = |list: &&str| {
            (header::ACCEPT_ENCODING, HeaderValue::from_bytes(list.as_bytes()).unwrap())
        };
        Coding::wanted(&lists.iter().map(header).collect())
    }

    #[test]
    fn the_best_liked_is_chosen() {
        for list in [
            "gzip, deflate, br, zstd",
            "zstd",
            "ZSTD;q=0.1",
            "*, zstd",
            "gzip;q=0.5,zstd;q=0.5",
            "zstd;q=1, identity;q=1",
        ] {
            assert_eq!(choice(&[list]), Some(Coding::Zstd), "{list}");
        }
        for list in [
            "gzip",
            "GZip",
            "x-gzip",
            "*",
            "gzip, deflate",
            "zstd;q=0.5, gzip",
            "zstd;q=0, *",
            "identity;q=0, *;q=0.1",
            "br,gzip;Q=0.3",
        ] {
            assert_eq!(choice(&[list]), Some(Coding::Gzip), "{list}");
        }
        let nothing = [
            "",
            ",",
            " , ;q=1",
            "identity",
            "br",
            "deflate",
            "gzip;q=0",
            "gzip; q=0.000",
            "*;q=0",
            "identity;q=0",
            "gzip;q=0.5, identity",
        ];
        for list in nothing.into_iter().chain(["gzip;q=0, *", "zstandard", "gzip2", "\u{fc}"]) {
            assert_eq!(choice(&[list]), None, "{list}");
        }
        assert_eq!(choice(&[]), None);
        assert_eq!(choice(&["gzip", "zstd"]), Some(Coding::Zstd), "two headers are one list");
    }

    #[test]
    fn a_quality_that_is_none_counts_as_none_given() {
        for list in ["gzip;q=high", "gzip;q=nan", "gzip;q=-1", "gzip;q=7", "gzip;q="] {
            assert_eq!(choice(&[list]), Some(Coding::Gzip), "{list}");
        }
    }
}
