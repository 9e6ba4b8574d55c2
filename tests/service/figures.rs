//! The figures of the papers: every request in examples/ is drawn, and facts about the picture are
//! checked.

use std::path::{Path, PathBuf};

use serde_json::Value;
use springline::api::json::from_bytes;
use springline::api::operations::Operation;
use springline::api::operations::render::{Render, RenderRequest};
use springline::core::context::Context;

const FIGURES: [&str; 19] = [
    "chen-01", "chen-02", "chen-03", "chen-04", "chen-05", "chen-06", "cheng-03", "cheng-04",
    "cheng-09", "cheng-11", "cheng-12", "cheng-13", "li-01", "li-02", "li-03", "li-04", "li-05",
    "li-06", "li-07",
];

/// Those that docs/images shows.
const SHOWN: [&str; 6] = ["cheng-03", "cheng-12", "chen-05", "li-04", "li-06", "li-07"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

fn request(name: &str) -> String {
    std::fs::read_to_string(root().join(format!("examples/{name}.json"))).unwrap()
}

fn read(text: &str) -> RenderRequest {
    from_bytes(&Context::default(), text.as_bytes()).unwrap()
}

fn draw(text: &str) -> String {
    Render::compute(&Context::default(), read(text)).unwrap()
}

fn refused(text: &str) -> String {
    Render::compute(&Context::default(), read(text)).unwrap_err().to_string()
}

/// Checks that tags nest and that text is escaped; returns the tags with their attributes.
fn elements(svg: &str) -> Vec<(String, Vec<(String, String)>)> {
    let (mut open, mut found, mut rest) = (Vec::new(), Vec::new(), svg);
    while let Some(start) = rest.find('<') {
        let (text, tail) = rest.split_at(start);
        check_text(text);
        let end = tail.find('>').expect("a tag ends");
        let tag = &tail[1..end];
        rest = &tail[end + 1..];
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name));
            continue;
        }
        let element = element(tag.trim_end_matches('/'));
        if !tag.ends_with('/') {
            open.push(element.0.clone());
        }
        found.push(element);
    }
    assert!(open.is_empty() && rest.trim().is_empty(), "{open:?} {rest:?}");
    found
}

fn check_text(text: &str) {
    for part in text.split('&').skip(1) {
        let known =
            ["amp;", "lt;", "gt;", "quot;", "#39;"].iter().any(|name| part.starts_with(name));
        assert!(known, "a bare & in {text:?}");
    }
}

fn element(tag: &str) -> (String, Vec<(String, String)>) {
    let (name, mut rest) = tag.split_once(' ').unwrap_or((tag, ""));
    let mut attributes = Vec::new();
    while let Some((key, tail)) = rest.trim_start().split_once("=\"") {
        let (value, tail) = tail.split_once('"').expect("a value ends");
        check_text(value);
        assert!(!attributes.iter().any(|(known, _)| known == key), "{key} twice in {tag}");
        attributes.push((key.to_owned(), value.to_owned()));
        rest = tail;
    }
    assert!(rest.trim().is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric()), "{tag}");
    (name.to_owned(), attributes)
}

/// The path data inside a group, one per path.
fn paths<'a>(svg: &'a str, class: &str) -> Vec<&'a str> {
    let Some((_, tail)) = svg.split_once(&format!("<g class=\"{class}\"")) else {
        return Vec::new();
    };
    let group = tail.split("</g>").next().unwrap();
    group.split(" d=\"").skip(1).map(|part| part.split('"').next().unwrap()).collect()
}

fn numbers(data: &str) -> Vec<f64> {
    data.split_whitespace().filter_map(|word| word.parse().ok()).collect()
}

/// How often a command occurs in path data.
fn count(data: &str, command: &str) -> usize {
    data.split_whitespace().filter(|word| *word == command).count()
}

#[test]
fn there_is_one_request_for_each_figure_and_a_list_of_them() {
    let listed = std::fs::read_to_string(root().join("examples/README.md")).unwrap();
    let entries =
        std::fs::read_dir(root().join("examples")).unwrap().map(|entry| entry.unwrap().path());
    let mut names: Vec<String> = entries
        .filter(|path| path.extension().is_some_and(|extension| extension == "json"))
        .map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    names.sort();
    assert_eq!(names, FIGURES);
    FIGURES.iter().for_each(|name| assert!(listed.contains(&format!("]({name}.json)")), "{name}"));
}

#[test]
fn every_figure_is_well_formed_finite_and_the_same_twice() {
    for name in FIGURES {
        let svg = draw(&request(name));
        let elements = elements(&svg);
        assert_eq!(elements[0].0, "svg", "{name}");
        assert_eq!(elements.iter().filter(|(tag, _)| tag == "title").count(), 1, "{name}");
        let data =
            elements.iter().flat_map(|(_, attributes)| attributes).filter(|(key, _)| key == "d");
        for (_, data) in data {
            let words =
                data.split_whitespace().filter(|word| !["M", "L", "Q", "C", "Z"].contains(word));
            words.for_each(|word| {
                assert!(word.parse::<f64>().is_ok_and(f64::is_finite), "{name}: {word}")
            });
        }
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{name}");
        assert_eq!(svg, draw(&request(name)), "{name}");
    }
}

#[test]
fn every_curve_of_a_figure_is_one_path() {
    for name in FIGURES {
        let body: Value = serde_json::from_str(&request(name)).unwrap();
        let curves = body["curves"].as_array().map_or(0, Vec::len);
        assert_eq!(paths(&draw(&request(name)), "curves").len(), curves, "{name}");
    }
}

#[test]
fn everything_drawn_is_on_the_page() {
    for name in FIGURES {
        let body: Value = serde_json::from_str(&request(name)).unwrap();
        let (width, height) = (body["width"].as_f64().unwrap(), body["height"].as_f64().unwrap());
        let svg = draw(&request(name));
        for data in ["polygon", "surface"].iter().flat_map(|class| paths(&svg, class)) {
            for pair in numbers(data).chunks(2) {
                assert!(
                    (0.0..=width).contains(&pair[0]) && (0.0..=height).contains(&pair[1]),
                    "{name} {pair:?}"
                );
            }
        }
    }
}

/// Bezier points in pixels to the units of the request, by two known points.
fn units(data: &str, first: [f64; 2], last: [f64; 2]) -> Vec<[f64; 2]> {
    let pixels = numbers(data);
    let (a, b) = (pixels[0], pixels[pixels.len() - 2]);
    let unit = (last[0] - first[0]) / (b - a);
    let down = pixels[1];
    pixels
        .chunks(2)
        .map(|p| [first[0] + (p[0] - a) * unit, first[1] - (p[1] - down) * unit])
        .collect()
}

fn assert_close(found: &[[f64; 2]], expected: &[[f64; 2]]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (p, q) in found.iter().zip(expected) {
        assert!((p[0] - q[0]).hypot(p[1] - q[1]) < 5e-4, "{found:?} {expected:?}");
    }
}

/// Cheng et al. 2021 Figure 3: Q1 and Q2 by eq. (8) and (9), on the polygon for beta = 0 and at the
/// thirds of the base for infinity.
#[test]
fn figure_3_of_cheng_has_the_bezier_points_of_equations_8_and_9() {
    let svg = draw(&request("cheng-03"));
    let curves = paths(&svg, "curves");
    let bezier = |q1: [f64; 2], q2: [f64; 2]| [[0.0, 0.0], q1, q2, [5.0, 0.0]];
    let thirds = bezier([5.0 / 3.0, 0.0], [10.0 / 3.0, 0.0]);
    let expected =
        [bezier([1.0, 3.0], [4.0, 3.0]), bezier([14.0 / 9.0, 1.5], [31.0 / 9.0, 1.5]), thirds];
    for (data, expected) in curves.iter().zip(&expected) {
        assert_eq!((count(data, "M"), count(data, "C")), (1, 1));
        assert_close(&units(data, [0.0, 0.0], [5.0, 0.0]), expected);
    }
    assert_eq!(paths(&svg, "polygon").len(), 1, "one polygon for the three");
}

#[test]
fn figure_4_of_cheng_draws_one_curve_twice() {
    let svg = draw(&request("cheng-04"));
    let curves = paths(&svg, "curves");
    assert_eq!(curves[0], curves[1]);
}

#[test]
fn figure_11_of_cheng_draws_the_halves_of_figure_3() {
    let svg = draw(&request("cheng-11"));
    let curves = paths(&svg, "curves");
    let left = numbers(curves[0]);
    let right = numbers(curves[1]);
    assert_eq!(left[6..8], right[0..2], "they meet");
    let map = |x: f64| x * (right[6] - left[0]) / 5.0;
    let expected = [[0.0, 0.0], [7.0 / 9.0, 0.75], [59.0 / 36.0, 1.125], [2.5, 1.125]];
    for (pair, [x, y]) in left.chunks(2).zip(expected) {
        assert!(
            (pair[0] - left[0] - map(x)).abs() < 0.02 && (left[1] - pair[1] - map(y)).abs() < 0.02,
            "{left:?}"
        );
    }
}

#[test]
fn figure_13_of_cheng_is_one_curve_as_a_b_spline_too() {
    let svg = draw(&request("cheng-13"));
    let curves = paths(&svg, "curves");
    for (a, b) in numbers(curves[0]).iter().zip(numbers(curves[1])) {
        assert!((a - b).abs() < 0.02, "{curves:?}");
    }
}

#[test]
fn figure_12_of_cheng_closes_after_five_cubics() {
    let svg = draw(&request("cheng-12"));
    for data in paths(&svg, "curves") {
        assert_eq!((count(data, "M"), count(data, "C")), (1, 5));
        let pixels = numbers(data);
        assert_eq!(pixels[..2], pixels[pixels.len() - 2..]);
    }
}

#[test]
fn figure_5_of_chen_has_six_petals_on_each_flower() {
    let svg = draw(&request("chen-05"));
    let flowers = paths(&svg, "curves");
    assert_eq!(flowers.len(), 3);
    for data in flowers {
        // Degree 4: each petal is a whole number of cubics, and six petals come back to the centre.
        assert!(
            count(data, "C") >= 12 && count(data, "C").is_multiple_of(6),
            "{}",
            count(data, "C")
        );
        let pixels = numbers(data);
        let centre = pixels[..2].to_vec();
        let ends = pixels[2..].chunks(6).filter(|cubic| cubic[4..] == centre[..]);
        assert_eq!(ends.count(), 6);
    }
}

#[test]
fn figure_6_of_chen_has_three_vases_that_are_their_own_mirror_images() {
    let svg = draw(&request("chen-06"));
    for data in paths(&svg, "curves") {
        assert_eq!(count(data, "C"), 6);
        let outline: Vec<Vec<f64>> = numbers(data).chunks(2).map(<[f64]>::to_vec).collect();
        let axis = (outline[0][0] + outline[15][0]) / 2.0;
        for (right, left) in outline[..7].iter().zip(outline[9..16].iter().rev()) {
            assert!(
                (right[0] - axis + left[0] - axis).abs() < 0.03
                    && (right[1] - left[1]).abs() < 0.02,
                "{right:?} {left:?}"
            );
        }
    }
}

/// Li 2014, section 3.2: the larger alpha * beta, the nearer the curve to its polygon.
#[test]
fn figures_3_to_5_of_li_approach_the_polygon_in_order() {
    for name in ["li-03", "li-04", "li-05"] {
        let svg = draw(&request(name));
        let height: Vec<f64> = paths(&svg, "curves").iter().map(|data| numbers(data)[3]).collect();
        assert!(height.windows(2).all(|pair| pair[1] < pair[0]), "{name} {height:?}");
    }
}

#[test]
fn figure_7_of_li_has_four_shaded_surfaces_with_their_nets() {
    let svg = draw(&request("li-07"));
    assert_eq!(svg.matches("<g class=\"surface\"").count(), 4);
    assert_eq!(svg.matches("<g class=\"polygon\"").count(), 4);
    assert_eq!(paths(&svg, "polygon").len(), 8, "4 rows and 4 columns");
    assert_eq!(svg.matches(" Z\"").count(), 4 * 16 * 16);
}

#[test]
fn the_committed_pictures_are_those_drawn() {
    for name in SHOWN {
        let committed = std::fs::read_to_string(root().join(format!("docs/images/{name}.svg")))
            .unwrap_or_default();
        let again = format!(
            "docs/images/{name}.svg differs; post examples/{name}.json to /v1/render and keep the answer"
        );
        assert!(committed == draw(&request(name)), "{again}");
    }
}

#[test]
fn labels_and_titles_are_escaped() {
    let svg = draw(
        r#"{"curves": [{"curve": {"family": "bezier", "control_points": [[0, 0], [1, 1]]}, "label": "</text><script>\"&'"}],
            "title": "]]><a>&amp;"}"#,
    );
    elements(&svg);
    assert!(
        svg.contains("&lt;/text&gt;&lt;script&gt;&quot;&amp;&#39;")
            && svg.contains("<title>]]&gt;&lt;a&gt;&amp;amp;</title>")
    );
    assert!(!svg.contains("<script") && !svg.contains("<a"));
}

fn curve(points: &str, rest: &str) -> String {
    format!(
        r#"{{"curves": [{{"curve": {{"family": "bezier", "control_points": {points}}}}}]{rest}}}"#
    )
}

const ALL: &str = r#", "show": ["polygon", "joints", "comb", "axes", "legend"]"#;

#[test]
fn points_and_straight_lines_are_pictures_too() {
    let cases = [
        "[[0, 0], [0, 0]]",
        "[[3, 7], [3, 7], [3, 7], [3, 7]]",
        "[[0, 0], [5, 0]]",
        "[[2, 1], [2, 9]]",
        "[[1e-320, 0], [2e-320, 0]]",
        "[[1e300, 0], [-1e300, 1e299], [0, 0]]",
        "[[1e16, 1e16], [1e16, 1.0000000000000002e16]]",
        "[[0, 0, 0], [0, 0, 0]]",
        "[[0, 0, 0], [0, 0, 5]]",
        "[[0, 0, 0], [1e-200, 0, 0], [0, 1e-200, 1e-200]]",
        "[[0, 0], [1, 1], [0, 0], [-1, 1]]",
    ];
    for points in cases {
        let svg = draw(&curve(points, ALL));
        elements(&svg);
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{points}");
    }
}

#[test]
fn an_extent_beyond_doubles_is_refused() {
    assert!(refused(&curve("[[-1.7e308, 0], [1.7e308, 0]]", "")).contains("exceeds the range"));
}

#[test]
fn degrees_one_to_three_keep_their_command() {
    for (points, command) in [
        ("[[0, 0], [1, 1]]", "L"),
        ("[[0, 0], [1, 1], [2, 0]]", "Q"),
        ("[[0, 0], [1, 1], [2, 0], [3, 1]]", "C"),
    ] {
        let svg = draw(&curve(points, ""));
        let data = paths(&svg, "curves")[0];
        assert_eq!(count(data, command), 1, "{data}");
        assert_eq!(numbers(data).len(), points.matches('[').count() * 2 - 2, "{data}");
    }
}

#[test]
fn what_cannot_be_drawn_is_refused_at_its_place() {
    let line = "[[0, 0], [1, 1]]";
    let one = r#"{"curve": {"family": "bezier", "control_points": [[0, 0], [1, 1]]}"#;
    let space = r#"{"curve": {"family": "bezier", "control_points": [[0, 0, 0], [1, 1, 1]]}}"#;
    let long = "x".repeat(61);
    let cases = [
        (curve(line, r#", "width": 119"#), "/width"),
        (curve(line, r#", "height": 4001"#), "/height"),
        (curve(line, r#", "title": "a\u0000b""#), "/title"),
        (format!(r#"{{"curves": [{one}, "label": "{long}"}}]}}"#), "/curves/0/label"),
        (format!(r#"{{"curves": [{one}, "color": 8}}]}}"#), "/curves/0/color"),
        (format!(r#"{{"curves": [{one}}}, {space}]}}"#), "/curves/1/curve/control_points"),
        (r#"{"curves": []}"#.into(), "/curves"),
        (r#"{"surfaces": []}"#.into(), "/surfaces"),
        (format!(r#"{{"curves": [{}]}}"#, vec![format!("{one}}}"); 65].join(", ")), "/curves"),
        ("{}".into(), ""),
    ];
    for (body, place) in cases {
        assert!(refused(&body).starts_with(&format!("{place}: ")), "{place}: {}", refused(&body));
    }
}

/// The texts of a group.
fn words<'a>(svg: &'a str, class: &str) -> Vec<&'a str> {
    let tail = svg.split_once(&format!("<g class=\"{class}\"")).map_or("", |(_, tail)| tail);
    let group = tail.split("</g>").next().unwrap();
    group.split("stroke=\"none\">").skip(1).map(|part| part.split('<').next().unwrap()).collect()
}

#[test]
fn axes_tell_nearly_equal_coordinates_apart() {
    let svg = draw(&curve(
        "[[1000000, 0], [1000000.00001, 0.00003], [1000000.00004, 0]]",
        r#", "show": ["axes"]"#,
    ));
    let words = words(&svg, "axes");
    assert!(words.contains(&"x - 1000000"), "{words:?}");
    let along_x: Vec<&&str> =
        words.iter().skip(1).take_while(|word| !word.starts_with('y')).collect();
    let distinct: std::collections::BTreeSet<_> = along_x.iter().collect();
    assert!(along_x.len() > 4 && along_x.len() - distinct.len() <= 4, "{words:?}");
    assert!(words.iter().all(|word| !word.contains("e6")), "{words:?}");
}

#[test]
fn more_than_eight_curves_are_told_apart() {
    let one =
        r#"{"curve": {"family": "bezier", "control_points": [[0, 0], [1, 1]]}, "label": "a"}"#;
    let svg = draw(&format!(r#"{{"curves": [{}]}}"#, vec![one; 64].join(", ")));
    for class in ["curves", "legend"] {
        let looks: std::collections::BTreeSet<(String, String)> = elements(&svg)
            .into_iter()
            .filter(|(tag, attributes)| {
                tag == "path"
                    && attributes.iter().any(|(key, _)| key == "stroke-width")
                        == (class == "legend")
            })
            .map(|(_, attributes)| {
                let of = |name: &str| {
                    attributes
                        .iter()
                        .find(|(key, _)| key == name)
                        .map_or(String::new(), |(_, value)| value.clone())
                };
                (of("stroke"), of("stroke-dasharray"))
            })
            .collect();
        assert_eq!(looks.len(), 64, "{class}");
    }
}

#[test]
fn a_comb_has_the_scale_asked_for_and_a_near_cusp_leaves_the_rest_to_see() {
    // The arc of radius about 5 through (0, 0) and (10, 0): the lines are 5 units / 5 = 1 unit long
    // at scale 5.
    let points = "[[0, 0], [5, 2], [10, 0]]";
    let lines = |scale: &str| {
        let svg = draw(&curve(points, &format!(r#", "show": ["comb"]{scale}"#)));
        let unit = {
            let ends = numbers(paths(&svg, "curves")[0]);
            (ends[4] - ends[0]) / 10.0
        };
        let teeth = numbers(paths(&svg, "comb")[0]);
        teeth
            .chunks(4)
            .map(|line| (line[2] - line[0]).hypot(line[3] - line[1]) / unit)
            .fold(0.0, f64::max)
    };
    // The parabola's curvature is greatest in the middle: |x' y''| / |x'|^3 = 8 / 100.
    for scale in [1.0, 20.0, 100.0] {
        assert!(
            (lines(&format!(r#", "comb_scale": {scale}"#)) - 0.08 * scale).abs()
                < 0.01 * scale.max(2.0) * 0.08,
            "{scale}"
        );
    }
    let svg = draw(&curve("[[0, 0], [4, 3], [0.001, 3], [4, 0]]", r#", "show": ["comb"]"#));
    let long = numbers(paths(&svg, "comb")[0])
        .chunks(4)
        .filter(|line| (line[2] - line[0]).hypot(line[3] - line[1]) > 5.0)
        .count();
    assert!(long > 4, "{long} lines of the comb can be seen");
    for (rest, place) in [
        (r#", "comb_scale": 1"#, "/comb_scale"),
        (r#", "show": ["comb"], "comb_scale": 0"#, "/comb_scale"),
    ] {
        assert!(
            refused(&curve(points, rest)).starts_with(place),
            "{}",
            refused(&curve(points, rest))
        );
    }
}

/// A dome with its net above and below: lines of the net behind it are drawn before faces that
/// cover them.
#[test]
fn a_surface_covers_what_of_its_net_is_behind_it() {
    let svg = draw(&request("li-07"));
    let group = svg.split("<g class=\"surface\"").nth(1).unwrap().split("</g>").next().unwrap();
    let is_wire = |line: &&str| line.contains("stroke-width=\"1.2\"");
    let lines: Vec<&str> = group.lines().collect();
    let (first, last) =
        (lines.iter().position(&is_wire).unwrap(), lines.iter().rposition(&is_wire).unwrap());
    let faces = |part: &[&str]| part.iter().filter(|line| line.contains(" Z\"")).count();
    assert!(faces(&lines[first..]) > 100 && faces(&lines[..last]) > 100, "{first} {last}");
    assert!(svg.contains("<g class=\"polygon\" fill=\"none\" stroke=\"#7b828d\" stroke-width=\"1.2\" stroke-dasharray=\"3 4\""));
    assert!(
        !draw(&request("li-07").replace("\"polygon\"", "\"legend\""))
            .contains("stroke-width=\"1.2\"")
    );
}
