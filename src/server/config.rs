//! The settings, each declared once: flag, environment variable, key of the file, range and
//! default.

use std::ffi::OsString;
use std::fmt;
use std::fs;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use bytesize::ByteSize;
use clap::builder::RangedU64ValueParser;
use clap::parser::ValueSource;
use clap::{ArgMatches, Args, ValueEnum};
use serde::{Serialize, Serializer};

use crate::core::limits::{self, Limits};
use crate::http::logs::LogFormat;
use crate::http::settings::Settings;

/// How the service runs. A flag goes before its environment variable, that before the file, that
/// before the default.
#[derive(Debug, Clone, Args, Serialize)]
#[serde(rename_all = "kebab-case")]
#[command(next_help_heading = "Settings")]
pub struct Config {
    /// A TOML file with any of these settings, named as the flags are: `queue = 8`
    #[arg(long, global = true, env = "SPRINGLINE_CONFIG", value_name = "FILE")]
    #[serde(skip)]
    pub config: Option<PathBuf>,

    /// The address to listen on; port 0 takes any free port
    #[arg(
        long,
        global = true,
        env = "SPRINGLINE_LISTEN",
        value_name = "ADDR",
        default_value = "127.0.0.1:8080"
    )]
    pub listen: SocketAddr,
    /// An address of its own for /metrics, which the first then no longer answers
    #[arg(long, global = true, env = "SPRINGLINE_METRICS_LISTEN", value_name = "ADDR")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub metrics_listen: Option<SocketAddr>,

    /// Computations that run at once; 0 takes the cores this process may use
    #[arg(long, global = true, env = "SPRINGLINE_WORKERS", value_name = "N", default_value = "0", value_parser = whole(0, 1_024))]
    pub workers: usize,
    /// Computations that may wait for a worker, whatever they are expected to take; more are
    /// refused with 503
    #[arg(long, global = true, env = "SPRINGLINE_QUEUE", value_name = "N", default_value = "1024", value_parser = whole(0, 1_000_000))]
    pub queue: usize,
    /// Percent of the deadline that waiting and computing may be expected to take; what is expected
    /// to take longer, and would have to wait, is refused with 503
    #[arg(long, global = true, env = "SPRINGLINE_QUEUE_SHARE", value_name = "PERCENT", default_value = "50", value_parser = clap::value_parser!(u32).range(1..=100))]
    pub queue_share: u32,
    /// Open connections; more are refused with 503
    #[arg(long, global = true, env = "SPRINGLINE_CONNECTIONS", value_name = "N", default_value = "4096", value_parser = whole(1, 1_000_000))]
    pub connections: usize,
    /// Memory for request bodies and answers on their way; what finds no room is refused with 503
    #[arg(long, global = true, env = "SPRINGLINE_MEMORY", value_name = "SIZE", default_value = "192MiB", value_parser = size)]
    #[serde(serialize_with = "shown")]
    pub memory: Size,

    /// Time for the head of a request, and for the TLS handshake
    #[arg(long, global = true, env = "SPRINGLINE_HEADER_TIME", value_name = "TIME", default_value = "10s", value_parser = time)]
    #[serde(serialize_with = "shown")]
    pub header_time: Time,
    /// Time for the body of a request, in all
    #[arg(long, global = true, env = "SPRINGLINE_BODY_TIME", value_name = "TIME", default_value = "30s", value_parser = time)]
    #[serde(serialize_with = "shown")]
    pub body_time: Time,
    /// Time for a computation, waiting included
    #[arg(long, global = true, env = "SPRINGLINE_DEADLINE", value_name = "TIME", default_value = "30s", value_parser = time)]
    #[serde(serialize_with = "shown")]
    pub deadline: Time,
    /// Time for the client to take the answer, in all
    #[arg(long, global = true, env = "SPRINGLINE_ANSWER_TIME", value_name = "TIME", default_value = "60s", value_parser = time)]
    #[serde(serialize_with = "shown")]
    pub answer_time: Time,
    /// Time a connection may stay open without a request
    #[arg(long, global = true, env = "SPRINGLINE_IDLE_TIME", value_name = "TIME", default_value = "75s", value_parser = time)]
    #[serde(serialize_with = "shown")]
    pub idle_time: Time,
    /// Time after a signal to stop in which connections are still taken, so that load balancers can
    /// look away
    #[arg(long, global = true, env = "SPRINGLINE_GRACE", value_name = "TIME", default_value = "5s", value_parser = time)]
    #[serde(serialize_with = "shown")]
    pub grace: Time,
    /// Time after that for running requests to end
    #[arg(long, global = true, env = "SPRINGLINE_DRAIN", value_name = "TIME", default_value = "35s", value_parser = time)]
    #[serde(serialize_with = "shown")]
    pub drain: Time,

    /// The largest request body
    #[arg(long, global = true, env = "SPRINGLINE_MAX_BODY", value_name = "SIZE", default_value = "32MiB", value_parser = body_size)]
    #[serde(serialize_with = "shown")]
    pub max_body: Size,
    /// The deepest nesting of a request's JSON
    #[arg(long, global = true, env = "SPRINGLINE_MAX_DEPTH", value_name = "N", default_value = "127", value_parser = whole(8, 127))]
    pub max_depth: usize,
    /// The highest degree of a segment and order of a derivative
    #[arg(long, global = true, env = "SPRINGLINE_MAX_DEGREE", value_name = "N", default_value_t = limits::DEGREE, value_parser = whole(3, limits::DEGREE))]
    pub max_degree: usize,
    /// Points to interpolate or to fit
    #[arg(long, global = true, env = "SPRINGLINE_MAX_POINTS", value_name = "N", default_value_t = limits::DATA_POINTS, value_parser = whole(4, limits::DATA_POINTS))]
    pub max_points: usize,
    /// Control points of one curve or surface
    #[arg(long, global = true, env = "SPRINGLINE_MAX_CONTROL_POINTS", value_name = "N", default_value_t = limits::CONTROL_POINTS, value_parser = whole(4, limits::CONTROL_POINTS))]
    pub max_control_points: usize,
    /// Segments of a curve
    #[arg(long, global = true, env = "SPRINGLINE_MAX_SEGMENTS", value_name = "N", default_value_t = limits::SEGMENTS, value_parser = whole(2, limits::SEGMENTS))]
    pub max_segments: usize,
    /// Samples in one answer
    #[arg(long, global = true, env = "SPRINGLINE_MAX_SAMPLES", value_name = "N", default_value_t = limits::SAMPLES, value_parser = whole(2, limits::SAMPLES))]
    pub max_samples: usize,
    /// Points and vectors in one answer: samples times what is asked of each
    #[arg(long, global = true, env = "SPRINGLINE_MAX_ANSWER_POINTS", value_name = "N", default_value_t = limits::ANSWER_POINTS, value_parser = whole(2, limits::ANSWER_POINTS))]
    pub max_answer_points: usize,

    /// Keys of which a request must carry one, separated by commas; none: everybody may ask
    #[arg(
        long,
        global = true,
        env = "SPRINGLINE_API_KEYS",
        value_name = "KEYS",
        hide_env_values = true,
        value_delimiter = ','
    )]
    #[serde(skip)]
    pub api_keys: Vec<String>,
    /// A file with such keys, one a line; read again when it changes
    #[arg(long, global = true, env = "SPRINGLINE_API_KEYS_FILE", value_name = "FILE")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub api_keys_file: Option<PathBuf>,
    /// Origins whose pages may call from a browser, separated by commas; `*` for all; none: no page
    /// of another origin
    #[arg(
        long,
        global = true,
        env = "SPRINGLINE_CORS_ORIGINS",
        value_name = "ORIGINS",
        value_delimiter = ','
    )]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cors_origins: Vec<String>,
    /// A PEM file with the certificate chain; with --tls-key the service speaks TLS
    #[arg(long, global = true, env = "SPRINGLINE_TLS_CERT", value_name = "FILE")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tls_cert: Option<PathBuf>,
    /// A PEM file with the certificate's private key
    #[arg(long, global = true, env = "SPRINGLINE_TLS_KEY", value_name = "FILE")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tls_key: Option<PathBuf>,

    /// Whether answers are compressed, on the workers, for clients that ask; pays where the link is
    /// slow
    #[arg(
        long,
        global = true,
        env = "SPRINGLINE_COMPRESSION",
        value_name = "WHETHER",
        default_value = "off"
    )]
    pub compression: Compression,

    /// What to log: a level, or levels by module: `warn,springline=info`
    #[arg(
        long,
        global = true,
        env = "SPRINGLINE_LOG",
        value_name = "FILTER",
        default_value = "info"
    )]
    pub log: String,
    /// How to log
    #[arg(
        long,
        global = true,
        env = "SPRINGLINE_LOG_FORMAT",
        value_name = "FORMAT",
        default_value = "auto"
    )]
    pub log_format: LogFormat,
    /// Where to send traces by OTLP over HTTP: `http://collector:4318`
    #[arg(long, global = true, env = "SPRINGLINE_OTLP_ENDPOINT", value_name = "URL")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub otlp_endpoint: Option<String>,
}

/// Whether answers are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Compression {
    /// Never
    Off,
    /// As `Accept-Encoding` asks: zstd or gzip
    On,
}

/// A time span, printed as it is written: `1m 30s`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Time(pub Duration);

/// A size in bytes, printed as it is written: `32.0 MiB`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size(pub usize);

impl fmt::Display for Time {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        humantime::format_duration(self.0).fmt(f)
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}B", self.0)
    }
}

fn shown<S: Serializer>(value: &impl fmt::Display, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(value)
}

fn whole(least: usize, most: usize) -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(least as u64..=most as u64)
}

fn time(text: &str) -> Result<Time, String> {
    let given = humantime::parse_duration(text)
        .map_err(|error| format!("{error}; write 500ms, 10s, 1m"))?;
    if given > Duration::from_secs(86_400) {
        return Err("at most 1d".into());
    }
    Ok(Time(given))
}

fn size(text: &str) -> Result<Size, String> {
    let given =
        ByteSize::from_str(text).map_err(|error| format!("{error}; write 65536, 512KiB, 32MiB"))?;
    usize::try_from(given.as_u64())
        .map(Size)
        .map_err(|_| "more than this machine can address".into())
}

fn body_size(text: &str) -> Result<Size, String> {
    let given = size(text)?;
    let most = limits::BODY_BYTES;
    if (1_024..=most).contains(&given.0) {
        Ok(given)
    } else {
        Err(format!("allowed is 1KiB to {}", ByteSize::b(most as u64)))
    }
}

impl Config {
    /// What the service itself is set to.
    pub fn settings(&self) -> Settings {
        Settings {
            workers: self.worker_count(),
            queue: self.queue,
            patience: self.deadline.0 * self.queue_share / 100,
            limits: self.limits(),
            memory: self.memory.0,
            api_keys: self.api_keys.clone(),
            api_keys_file: self.api_keys_file.clone(),
            otlp_endpoint: self.otlp_endpoint.clone(),
            max_body: self.max_body.0,
            max_depth: self.max_depth,
            body_time: self.body_time.0,
            deadline: self.deadline.0,
            compression: self.compression == Compression::On,
            metrics_elsewhere: self.metrics_listen.is_some(),
        }
    }

    /// The sizes the core accepts.
    pub fn limits(&self) -> Limits {
        Limits {
            degree: self.max_degree,
            control_points: self.max_control_points,
            data_points: self.max_points,
            samples: self.max_samples,
            answer_points: self.max_answer_points,
            segments: self.max_segments,
        }
    }

    /// Computations that run at once: as set, or the cores this process may use.
    pub fn worker_count(&self) -> usize {
        match self.workers {
            0 => std::thread::available_parallelism().map_or(2, usize::from),
            given => given,
        }
    }

    /// The effective settings as a file that would set them again, without the keys.
    pub fn to_toml(&self) -> String {
        let text = toml::to_string(self).unwrap_or_else(|error| format!("# {error}\n"));
        let keys = self.api_keys.len();
        if keys == 0 { text } else { format!("{text}# api-keys: {keys} given, not shown\n") }
    }
}

/// The settings of a file as flags, to be parsed like flags: only those that neither a flag nor a
/// variable has set.
///
/// # Errors
/// A file that cannot be read, is not TOML, or has a key or a kind of value that is no setting.
pub fn flags_of_file(matches: &ArgMatches) -> Result<Vec<OsString>, String> {
    let Some(path) = matches.get_one::<PathBuf>("config") else { return Ok(Vec::new()) };
    let within = |error: &dyn fmt::Display| format!("{}: {error}", path.display());
    let text = fs::read_to_string(path).map_err(|error| within(&error))?;
    let table: toml::Table = text.parse().map_err(|error| within(&error))?;
    let mut flags = Vec::new();
    for (key, value) in &table {
        let id = key.replace('-', "_");
        let known = key != "config" && !key.contains('_') && matches.try_contains_id(&id).is_ok();
        if !known {
            return Err(within(&format!(
                "there is no setting `{key}`; `springline config` prints them all"
            )));
        }
        let set =
            matches.value_source(&id).is_some_and(|source| source != ValueSource::DefaultValue);
        if !set {
            let text = flag_text(value).map_err(|error| within(&format!("`{key}` {error}")))?;
            flags.push(format!("--{key}={text}").into());
        }
    }
    Ok(flags)
}

fn flag_text(value: &toml::Value) -> Result<String, &'static str> {
    use toml::Value;
    match value {
        Value::String(text) => Ok(text.clone()),
        Value::Integer(number) => Ok(number.to_string()),
        Value::Array(items) => {
            Ok(items.iter().map(flag_text).collect::<Result<Vec<_>, _>>()?.join(","))
        }
        _ => Err("is neither text, nor a whole number, nor a list of them"),
    }
}

/// Environment variables that look like settings and are none: most likely misspelt.
pub fn unknown_variables(command: &clap::Command) -> Vec<String> {
    let known: Vec<_> = command.get_arguments().filter_map(|argument| argument.get_env()).collect();
    let named = std::env::vars_os().map(|(name, _)| name);
    let ours = named.filter(|name| {
        name.to_string_lossy().starts_with("SPRINGLINE_") && !known.contains(&name.as_os_str())
    });
    ours.map(|name| name.to_string_lossy().into_owned()).collect()
}
