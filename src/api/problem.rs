//! The one shape of every error: RFC 9457 problem details.

use std::fmt;
use std::time::Duration;

use serde::Serialize;
use utoipa::ToSchema;

use crate::api::error::{self, Error};
use crate::core;
use crate::core::fault::Fault;

/// An HTTP status by its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Status(pub u16);

impl Status {
    /// The request is not understood.
    pub const BAD_REQUEST: Self = Status(400);
    /// A key is needed.
    pub const UNAUTHORIZED: Self = Status(401);
    /// There is nothing here.
    pub const NOT_FOUND: Self = Status(404);
    /// Not with this method.
    pub const METHOD_NOT_ALLOWED: Self = Status(405);
    /// No format of the answer is acceptable.
    pub const NOT_ACCEPTABLE: Self = Status(406);
    /// The body did not arrive in time.
    pub const REQUEST_TIMEOUT: Self = Status(408);
    /// Beyond a limit.
    pub const PAYLOAD_TOO_LARGE: Self = Status(413);
    /// The format of the body is not known.
    pub const UNSUPPORTED_MEDIA_TYPE: Self = Status(415);
    /// Understood, and impossible.
    pub const UNPROCESSABLE_ENTITY: Self = Status(422);
    /// A fault of the service.
    pub const INTERNAL_SERVER_ERROR: Self = Status(500);
    /// No room now.
    pub const SERVICE_UNAVAILABLE: Self = Status(503);
    /// It took too long.
    pub const GATEWAY_TIMEOUT: Self = Status(504);
}

/// A problem (RFC 9457), the body of every answer that is not a success.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct Problem {
    /// A stable name of the kind of problem: `urn:springline:problem:` and the code.
    #[serde(rename = "type")]
    #[schema(rename = "type")]
    kind: Box<str>,
    /// The kind of problem in words; the same for every occurrence.
    title: &'static str,
    /// The HTTP status.
    status: u16,
    /// What is wrong this time, what is allowed, and what to do.
    detail: String,
    /// A stable name to branch on, in snake case.
    code: &'static str,
    /// The values at fault.
    errors: Box<[Item]>,
    /// The line of the request body, from 1, where the JSON itself is broken.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    line: Option<u32>,
    /// The column of that line, from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    column: Option<u32>,
    /// The header Retry-After, where the service is full.
    #[serde(skip)]
    retry_after: u64,
}

/// One value at fault.
#[derive(Debug, Clone, Serialize, ToSchema)]
pub struct Item {
    /// A JSON Pointer (RFC 6901) into the request body: to the offending value; for an unknown
    /// field to its name, for a missing one to the object that lacks it.
    pointer: String,
    /// What is wrong with it, as a stable name.
    code: &'static str,
    /// What is wrong with it, in words.
    detail: String,
}

impl Item {
    fn in_words(&self) -> String {
        let place =
            if self.pointer.is_empty() { String::new() } else { format!("{}: ", self.pointer) };
        format!("\n  {place}{}", self.detail)
    }
}

impl Problem {
    /// A problem of the request as a whole.
    pub fn new(
        status: Status,
        code: &'static str,
        title: &'static str,
        detail: impl Into<String>,
    ) -> Self {
        let kind = format!("urn:springline:problem:{code}").into();
        let (status, detail) = (status.0, detail.into());
        Problem {
            kind,
            title,
            status,
            detail,
            code,
            errors: Box::default(),
            line: None,
            column: None,
            retry_after: 1,
        }
    }

    /// A problem of one value.
    pub fn at(
        status: Status,
        code: &'static str,
        title: &'static str,
        pointer: String,
        detail: String,
    ) -> Self {
        let what = if pointer.is_empty() { detail.clone() } else { format!("{pointer}: {detail}") };
        Problem {
            errors: Box::new([Item { pointer, code, detail }]),
            ..Problem::new(status, code, title, what)
        }
    }

    /// The problem of a request with these faults, of `total` in all. What is said of the request
    /// as a whole is that of the first fault of the most basic kind: the shape before the
    /// mathematics.
    pub fn of_all(faults: Vec<FoundFault>, total: usize) -> Self {
        let lead =
            faults.iter().find(|fault| fault.status == Status::BAD_REQUEST).or(faults.first());
        let Some(lead) = lead.cloned() else { return Problem::internal() };
        let mut problem = Problem::at(
            lead.status,
            lead.item.code,
            lead.title,
            lead.item.pointer,
            lead.item.detail,
        );
        match total {
            0 | 1 => {}
            2 => problem.detail.push_str(" (and 1 more fault; see errors)"),
            ..=LISTED => {
                problem.detail.push_str(&format!(" (and {} more faults; see errors)", total - 1))
            }
            _ => problem.detail.push_str(&format!(
                " (and more than {} more faults; errors lists the first {LISTED})",
                LISTED - 1
            )),
        }
        problem.errors = faults.into_iter().take(LISTED).map(|fault| fault.item).collect();
        problem
    }

    /// The same problem with the values at fault.
    pub fn with_faults(mut self, faults: Vec<FoundFault>) -> Self {
        self.errors = faults.into_iter().take(LISTED).map(|fault| fault.item).collect();
        self
    }

    /// The same problem with the position in the text.
    pub fn with_position(self, line: usize, column: usize) -> Self {
        let known = |position| u32::try_from(position).ok();
        Problem { line: known(line), column: known(column), ..self }
    }

    /// No room now, for this reason.
    pub fn overloaded(reason: &str) -> Self {
        let detail = format!("{reason}; try again after as many seconds as Retry-After says");
        Problem::new(Status::SERVICE_UNAVAILABLE, "overloaded", "The service is full", detail)
    }

    /// Its HTTP status.
    pub fn status(&self) -> Status {
        Status(self.status)
    }

    /// Its title and its detail.
    pub fn text(&self) -> (&'static str, &str) {
        (self.title, &self.detail)
    }

    /// Seconds until it may be over, where the service is full.
    pub fn retry_after(&self) -> u64 {
        self.retry_after
    }

    /// The same problem, which is over after this time, or about.
    pub fn for_about(self, time: Duration) -> Self {
        Problem { retry_after: time.as_secs_f64().ceil().max(1.0) as u64, ..self }
    }

    /// Its stable name.
    pub fn code(&self) -> &'static str {
        self.code
    }

    /// For people: the title, and below it each fault with its place.
    pub fn in_words(&self) -> String {
        let position = self.line.zip(self.column);
        let position = position
            .map_or(String::new(), |(line, column)| format!(" (line {line}, column {column})"));
        let faults: String = match &*self.errors {
            [] => format!("\n  {}", self.detail),
            faults => faults.iter().map(Item::in_words).collect(),
        };
        format!("{}{position}{faults}", self.title)
    }

    /// A bug of ours; the client learns nothing of its insides.
    pub fn internal() -> Self {
        let detail = "the server failed while it worked on this request; nothing was changed, and the fault is ours";
        Problem::new(Status::INTERNAL_SERVER_ERROR, "internal", "Internal error", detail)
    }
}

/// As many faults are listed.
const LISTED: usize = 20;

/// A fault of a value, and what it makes of the request.
#[derive(Debug, Clone)]
pub struct FoundFault {
    status: Status,
    title: &'static str,
    item: Item,
}

impl FoundFault {
    /// A fault of a value that cannot be read.
    pub fn unread(pointer: String, code: &'static str, detail: String) -> Self {
        let (status, title) = match code {
            "too_large" => (Status::PAYLOAD_TOO_LARGE, "Beyond a limit"),
            _ => (Status::BAD_REQUEST, "The JSON is not the shape of this request"),
        };
        FoundFault { status, title, item: Item { pointer, code, detail } }
    }

    /// Where it is.
    pub fn pointer(&self) -> &str {
        &self.item.pointer
    }

    /// Whether something is not there.
    pub fn is_absence(&self) -> bool {
        self.item.code == "missing_field"
    }
}

impl From<Error> for FoundFault {
    fn from(error: Error) -> Self {
        let (status, code, title) = classify(&error.fault);
        FoundFault {
            status,
            title,
            item: Item { pointer: error.place.to_string(), code, detail: error.fault.to_string() },
        }
    }
}

/// Status, code and title of each fault.
fn classify(fault: &error::Fault) -> (Status, &'static str, &'static str) {
    match fault {
        error::Fault::Missing { .. } | error::Fault::MissingTag { .. } => {
            (Status::BAD_REQUEST, "missing_field", "A field is missing")
        }
        error::Fault::ForeignField { .. } => {
            (Status::BAD_REQUEST, "unknown_field", "A field does not belong here")
        }
        error::Fault::Core(fault) => classify_core(fault),
    }
}

fn classify_core(fault: &Fault) -> (Status, &'static str, &'static str) {
    use Status as S;
    match fault {
        Fault::TooLarge { .. } => (S::PAYLOAD_TOO_LARGE, "too_large", "Beyond a limit"),
        Fault::TooFew { .. } => (S::UNPROCESSABLE_ENTITY, "too_few", "Too few"),
        Fault::WrongCount { .. } => (S::UNPROCESSABLE_ENTITY, "wrong_count", "Counts do not match"),
        Fault::OutOfRange { .. } => {
            (S::UNPROCESSABLE_ENTITY, "out_of_range", "A value is out of range")
        }
        Fault::NotIncreasing { .. } => {
            (S::UNPROCESSABLE_ENTITY, "not_increasing", "Values are out of order")
        }
        Fault::RepeatedPoint { .. } => {
            (S::UNPROCESSABLE_ENTITY, "repeated_point", "A point is repeated")
        }
        Fault::UnsuitableBasis(_) => {
            (S::UNPROCESSABLE_ENTITY, "unsuitable_basis", "The basis cannot be used this way")
        }
        Fault::UnsuitableCurve(_) => {
            (S::UNPROCESSABLE_ENTITY, "unsuitable_curve", "The curve cannot be used this way")
        }
        Fault::UnsuitableText(_) => {
            (S::UNPROCESSABLE_ENTITY, "unsuitable_text", "The text cannot be drawn")
        }
        Fault::Contradiction(_) => {
            (S::UNPROCESSABLE_ENTITY, "contradiction", "Options contradict each other")
        }
        Fault::ShapeRank { .. } => {
            (S::UNPROCESSABLE_ENTITY, "rank_deficient_shape", "The shape matrix lacks rank")
        }
        Fault::RowSum { .. } => (S::UNPROCESSABLE_ENTITY, "row_sum", "A row does not sum to 1"),
        Fault::IllConditioned { .. } => {
            (S::UNPROCESSABLE_ENTITY, "ill_conditioned", "The basis is too ill-conditioned")
        }
        Fault::RankDeficient(_) => {
            (S::UNPROCESSABLE_ENTITY, "rank_deficient", "The data does not determine the answer")
        }
        Fault::ToleranceTooSmall { .. } => {
            (S::UNPROCESSABLE_ENTITY, "tolerance_too_small", "The tolerance is below rounding")
        }
        Fault::ToleranceNotMet { .. } => {
            (S::UNPROCESSABLE_ENTITY, "tolerance_not_met", "The tolerance cannot be met")
        }
        Fault::NotFinite => (S::UNPROCESSABLE_ENTITY, "not_finite", "A number is not finite"),
        Fault::Overflow => {
            (S::UNPROCESSABLE_ENTITY, "overflow", "The result is beyond double precision")
        }
        // The client that waited too long has been answered already.
        Fault::Cancelled => (S::GATEWAY_TIMEOUT, "deadline", "The deadline has passed"),
    }
}

impl From<Error> for Problem {
    fn from(error: Error) -> Self {
        let faults: Vec<FoundFault> = error.each().into_iter().map(FoundFault::from).collect();
        let total = faults.len();
        Problem::of_all(faults, total)
    }
}

impl From<core::error::Error> for Problem {
    fn from(error: core::error::Error) -> Self {
        Error::from(error).into()
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}: {}", self.status, self.code, self.detail)
    }
}

/// The errors that every operation can answer with, for the specification.
#[derive(utoipa::IntoResponses)]
#[allow(dead_code, reason = "read by the specification only")]
pub enum Problems {
    /// Not JSON, or not the shape of the request: unknown, repeated or missing fields, values of
    /// another type.
    #[response(status = 400, content_type = "application/problem+json")]
    BadRequest(Problem),
    /// The service wants an API key, and none it knows came with the request.
    #[response(status = 401, content_type = "application/problem+json")]
    Unauthorized(Problem),
    /// `Accept` allows nothing that this operation answers with.
    #[response(status = 406, content_type = "application/problem+json")]
    NotAcceptable(Problem),
    /// The body took too long to arrive.
    #[response(status = 408, content_type = "application/problem+json")]
    Timeout(Problem),
    /// The body, or the answer asked for, is beyond a documented limit.
    #[response(status = 413, content_type = "application/problem+json")]
    TooLarge(Problem),
    /// The body is not declared as a media type that is read here.
    #[response(status = 415, content_type = "application/problem+json")]
    MediaType(Problem),
    /// The shape is right, but the mathematics forbids it; the detail says why and what would work.
    #[response(status = 422, content_type = "application/problem+json")]
    Unprocessable(Problem),
    /// A fault of the server.
    #[response(status = 500, content_type = "application/problem+json")]
    Internal(Problem),
    /// The service is full; the header Retry-After says how many seconds to wait.
    #[response(status = 503, content_type = "application/problem+json")]
    Overloaded(Problem),
    /// The computation took too long.
    #[response(status = 504, content_type = "application/problem+json")]
    Deadline(Problem),
}
