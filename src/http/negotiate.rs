//! What a client sends and wants: media types, and the shape of numbers.

use axum::http::{HeaderMap, header};

use crate::api::output::{Format, Layout, Precision, RAW};
use crate::api::problem::{Problem, Status};
use crate::api::sentences::shortened;
use crate::api::wire::meant;

/// How a body is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BodyFormat {
    /// As JSON.
    Json,
    /// In the raw format.
    Raw,
}

/// The form of the body, by its `Content-Type`.
///
/// # Errors
/// Status 415; a compressed body too.
pub fn sent(headers: &HeaderMap) -> Result<BodyFormat, Problem> {
    check_uncompressed(headers)?;
    let given = content_type(headers);
    if given == "application/json" {
        return Ok(BodyFormat::Json);
    }
    let essence = essence(given);
    if essence == RAW {
        return Ok(BodyFormat::Raw);
    }
    if essence == "application/json"
        || (essence.starts_with("application/") && essence.ends_with("+json"))
    {
        return Ok(BodyFormat::Json);
    }
    let was = if given.is_empty() {
        "no Content-Type was sent".to_owned()
    } else {
        format!("the Content-Type is {}", shortened(given))
    };
    let detail = format!(
        "{was}; send the header Content-Type: application/json, or {RAW} for the raw format"
    );
    Err(Problem::new(
        Status::UNSUPPORTED_MEDIA_TYPE,
        "unsupported_media_type",
        "Unsupported media type",
        detail,
    ))
}

/// Refuses a compressed body.
///
/// # Errors
/// Status 415.
pub(super) fn check_uncompressed(headers: &HeaderMap) -> Result<(), Problem> {
    let Some(coding) = headers
        .get(header::CONTENT_ENCODING)
        .filter(|coding| !coding.as_bytes().eq_ignore_ascii_case(b"identity"))
    else {
        return Ok(());
    };
    let coding = shortened(&String::from_utf8_lossy(coding.as_bytes()));
    let detail = format!(
        "the Content-Encoding is {coding}; send the body uncompressed, without this header"
    );
    Err(Problem::new(
        Status::UNSUPPORTED_MEDIA_TYPE,
        "unsupported_media_type",
        "Unsupported media type",
        detail,
    ))
}

/// What `Content-Type` says, or nothing.
pub(super) fn content_type(headers: &HeaderMap) -> &str {
    headers.get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok()).unwrap_or("")
}

/// A media type without its parameters, in lower case.
pub(super) fn essence(media_type: &str) -> String {
    media_type.split(';').next().unwrap_or("").trim().to_ascii_lowercase()
}

/// Which of the media types offered, the first preferred, `Accept` likes best (RFC 9110 section
/// 12.5.1).
///
/// # Errors
/// Status 406.
pub fn wanted(headers: &HeaderMap, offered: &[&'static str]) -> Result<&'static str, Problem> {
    let first = *offered.first().unwrap_or(&"application/json");
    let mut all = headers.get_all(header::ACCEPT).iter();
    match (all.next(), all.next()) {
        (None, _) => return Ok(first),
        // What nearly all clients send.
        (Some(only), None) if only == "*/*" || only == first => return Ok(first),
        _ => {}
    }
    let lists: Vec<&str> =
        headers.get_all(header::ACCEPT).iter().filter_map(|value| value.to_str().ok()).collect();
    let ranges: Vec<(String, f64)> =
        lists.iter().flat_map(|list| list.split(',')).map(weighed).collect();
    let quality = |offer: &str| {
        let fits = |range: &str| {
            if range == offer {
                3
            } else if range == "*/*" {
                1
            } else {
                2 * usize::from(
                    range
                        .strip_suffix('*')
                        .is_some_and(|kind| kind.ends_with('/') && offer.starts_with(kind)),
                )
            }
        };
        let best = ranges
            .iter()
            .map(|(range, quality)| (fits(range), *quality))
            .filter(|(fit, _)| *fit > 0);
        best.max_by_key(|(fit, _)| *fit).map_or(0.0, |(_, quality)| quality)
    };
    if ranges.is_empty() {
        return Ok(first);
    }
    // The last of equals by `max_by` is the first offered.
    let best = offered.iter().rev().copied().max_by(|a, b| quality(a).total_cmp(&quality(b)));
    best.filter(|offer| quality(offer) > 0.0).ok_or_else(|| {
        let detail = format!(
            "the header Accept is {}; this operation answers with {}",
            shortened(&lists.join(", ")),
            offered.join(" or ")
        );
        Problem::new(
            Status::NOT_ACCEPTABLE,
            "not_acceptable",
            "Nothing acceptable to answer with",
            detail,
        )
    })
}

/// What a header offers in one item of its list, a media range or a coding, in lower case, and its
/// quality (RFC 9110 section 12.4.2).
pub(super) fn weighed(text: &str) -> (String, f64) {
    let quality = |parameter: &str| {
        parameter.trim().strip_prefix(['q', 'Q'])?.strip_prefix('=')?.parse().ok()
    };
    let qualities = text.split(';').skip(1).find_map(quality);
    (essence(text), qualities.filter(|quality| (0.0..=1.0).contains(quality)).unwrap_or(1.0))
}

/// The shape of numbers that the query of the address asks for: `precision` and `layout`.
///
/// # Errors
/// Status 400: a parameter that is unknown, given twice or has another value.
pub fn format(query: Option<&str>) -> Result<Format, Problem> {
    let mut format = Format::default();
    let mut seen = Vec::new();
    for part in query.unwrap_or("").split('&').filter(|part| !part.is_empty()) {
        let (key, value) = part.split_once('=').unwrap_or((part, ""));
        match (key, value) {
            ("precision", value) => format.precision = precision(value)?,
            ("layout", "nested") => format.layout = Layout::Nested,
            ("layout", "flat") => format.layout = Layout::Flat,
            ("layout", _) => {
                return Err(refused(&format!(
                    "the parameter layout is `{}`; allowed is nested or flat",
                    shortened(value)
                )));
            }
            _ => return Err(refused(&unknown(key))),
        }
        if seen.contains(&key) {
            return Err(refused(&format!("the parameter {key} is given twice; give it once")));
        }
        seen.push(key);
    }
    Ok(format)
}

/// How precise: `full`, `single` or a number of digits.
///
/// # Errors
/// Status 400: something else.
pub fn precision(text: &str) -> Result<Precision, Problem> {
    // As the specification has it: no sign, no leading zero.
    let is_plain = !text.starts_with('0') && text.bytes().all(|byte| byte.is_ascii_digit());
    let digits = || {
        text.parse()
            .ok()
            .filter(|digits| is_plain && (1..=17).contains(digits))
            .map(Precision::Digits)
    };
    let known = match text {
        "full" => Some(Precision::Full),
        "single" => Some(Precision::Single),
        _ => digits(),
    };
    known.ok_or_else(|| {
        refused(&format!("the parameter precision is `{}`; allowed is full, single, or a number of digits from 1 to 17", shortened(text)))
    })
}

fn unknown(key: &str) -> String {
    let hint = meant(key, ["precision", "layout"].into_iter())
        .map_or(String::new(), |name| format!(" (did you mean {name}?)"));
    format!(
        "the parameter `{}` is unknown{hint}; the parameters are precision and layout",
        shortened(key)
    )
}

fn refused(what: &str) -> Problem {
    Problem::new(Status::BAD_REQUEST, "bad_query", "A parameter of the address is wrong", what)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: [&str; 2] = ["application/json", RAW];

    fn choice(accept: &str) -> Option<&'static str> {
        let headers = HeaderMap::from_iter([(header::ACCEPT, accept.parse().unwrap())]);
        wanted(&headers, &BOTH).ok()
    }

    #[test]
    fn the_best_liked_is_chosen() {
        assert_eq!(wanted(&HeaderMap::new(), &BOTH).unwrap(), "application/json");
        for accept in [
            "*/*",
            "application/*",
            "text/html, */*;q=0.1",
            "application/json",
            "application/vnd.springline.f64;q=0.5, application/json",
        ] {
            assert_eq!(choice(accept), Some("application/json"), "{accept}");
        }
        for accept in [
            RAW,
            "application/vnd.springline.f64, application/json;q=0.9",
            "Application/Vnd.Springline.F64",
            "application/json;q=0, */*",
        ] {
            assert_eq!(choice(accept), Some(RAW), "{accept}");
        }
        for accept in ["text/html", "application/json;q=0", "image/*"] {
            assert_eq!(choice(accept), None, "{accept}");
        }
    }

    #[test]
    fn parameters_are_known_and_single() {
        assert_eq!(format(None).unwrap(), Format::default());
        assert_eq!(
            format(Some("precision=6&layout=flat")).unwrap(),
            Format { precision: Precision::Digits(6), layout: Layout::Flat, raw: false }
        );
        assert_eq!(format(Some("precision=single")).unwrap().precision, Precision::Single);
        for query in [
            "precision=0",
            "precision=18",
            "precision=",
            "layout=round",
            "digits=3",
            "layout=flat&layout=flat",
        ] {
            assert!(format(Some(query)).is_err(), "{query}");
        }
    }
}
