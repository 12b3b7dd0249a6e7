//! `octolux view`, asked over its own sockets: who is let in, what is sent, and that what is written has the bits of `render`.

use std::fs;
use std::io::{Read, Write as _};
use std::net::{TcpListener, TcpStream};

use half::f16;
use octolux::film::{Picture, read_picture};
use serde_json::{Value, json};
use tungstenite::Message;

use crate::place::{Place, stdout};
use crate::viewed::Server;

fn in_halves(picture: &Picture) -> Vec<[f16; 3]> {
    picture.pixels.iter().map(|pixel| pixel.map(f16::from_f32)).collect()
}

/// The same with numbers in single precision: one side writes an `f32` with its own digits, the other with those of an `f64`.
fn in_single(value: &Value) -> Value {
    match value {
        Value::Number(number) => json!(number.as_f64().unwrap() as f32),
        Value::Array(items) => items.iter().map(in_single).collect(),
        Value::Object(items) => items.iter().map(|(key, item)| (key.clone(), in_single(item))).collect(),
        other => other.clone(),
    }
}

#[test]
fn requests_that_break_a_rule_are_refused_and_the_page_is_served() {
    let place = Place::new();
    let server = Server::start(&place, "in/small.toml --spp 1");
    let (host, token) = (format!("Host: {}\r\n", server.host), &server.token);
    let page = format!("/{token}/");
    // What the page is made of, by either name of this machine.
    for name in ["", "view.js", "view.css", "picture.js"] {
        assert_eq!(server.get(&format!("/{token}/{name}"), &host), 200, "{name}");
    }
    let port = server.host.rsplit_once(':').unwrap().1;
    assert_eq!(server.get(&page, &format!("Host: localhost:{port}\r\n")), 200);
    let own = format!("{host}Origin: http://{}\r\n", server.host);
    assert_eq!(server.upgrade(&own), 101);

    let refused = [
        ("a foreign name", server.get(&page, "Host: evil.example\r\n"), 403),
        (
            "a name that begins well",
            server.get(&page, "Host: localhost.evil.example\r\n"),
            403,
        ),
        ("no name", server.get(&page, ""), 403),
        (
            "two names",
            server.get(&page, &format!("{host}Host: evil.example\r\n")),
            403,
        ),
        ("no token", server.get("/", &host), 403),
        ("no token for a file", server.get("/view.js", &host), 403),
        (
            "another token",
            server.get(&format!("/{}/", "0".repeat(32)), &host),
            403,
        ),
        (
            "a part of the token",
            server.get(&format!("/{}/", &token[..31]), &host),
            403,
        ),
        (
            "a foreign page",
            server.get(&page, &format!("{host}Origin: http://evil.example\r\n")),
            403,
        ),
        (
            "a way out",
            server.get(&format!("/{token}/../../etc/passwd"), &host),
            404,
        ),
        (
            "a way out in disguise",
            server.get(&format!("/{token}/..%2f..%2fetc%2fpasswd"), &host),
            404,
        ),
        (
            "an absolute way out",
            server.get(&format!("/{token}//etc/passwd"), &host),
            404,
        ),
        (
            "the scene file",
            server.get(&format!("/{token}/in/small.toml"), &host),
            404,
        ),
        (
            "a way around the token",
            server.get(&format!("/{token}/../view.js"), &host),
            404,
        ),
        (
            "another verb",
            server.status(&format!("POST {page} HTTP/1.1\r\n{host}\r\n")),
            405,
        ),
        (
            "a head without end",
            server.get(&page, &format!("{host}X: {}\r\n", "x".repeat(20_000))),
            431,
        ),
        (
            "many headers",
            server.get(&page, &format!("{host}{}", "X: y\r\n".repeat(200))),
            400,
        ),
        ("no HTTP", server.status("hello\r\n\r\n"), 400),
        ("nothing of use", server.status("\0\u{1}\u{2}\r\n\r\n"), 400),
        (
            "a socket for a foreign page",
            server.upgrade(&format!("{host}Origin: http://evil.example\r\n")),
            403,
        ),
        (
            "a socket for a sandbox",
            server.upgrade(&format!("{host}Origin: null\r\n")),
            403,
        ),
        ("a socket for no page", server.upgrade(&host), 403),
        (
            "a socket by a foreign name",
            server.upgrade("Host: evil.example\r\nOrigin: http://evil.example\r\n"),
            403,
        ),
        (
            "a socket without a handshake",
            server.get(&format!("/{token}/live"), &own),
            400,
        ),
    ];
    for (what, status, expected) in refused {
        assert_eq!(status, expected, "{what}");
    }
    // None of it has hurt: the picture still comes.
    let mut page = server.page();
    page.wait_for("done");
    assert!(place.files().is_empty(), "nothing was written");
}

#[test]
fn half_a_handshake_is_dropped_and_keeps_nobody_out() {
    let place = Place::new();
    let server = Server::start(&place, "in/small.toml --spp 1");
    let halves: Vec<TcpStream> = (0..20)
        .map(|_| {
            let mut stream = server.connect();
            let half = format!("GET /{}/live HTTP/1.1\r\nHost: {}\r\nUpgr", server.token, server.host);
            stream.write_all(half.as_bytes()).unwrap();
            stream
        })
        .collect();
    server.page().wait_for("done");
    for mut half in halves {
        let mut answer = Vec::new();
        // The end of the stream, not the end of this test's patience.
        let closed = half.read_to_end(&mut answer);
        assert!(closed.is_ok() || closed.unwrap_err().kind() == std::io::ErrorKind::ConnectionReset);
        assert!(answer.is_empty());
    }
}

#[test]
fn messages_that_are_huge_or_no_messages_cost_a_page_and_not_the_render() {
    let place = Place::new();
    let server = Server::start(&place, "in/small.toml --spp 1");
    let mut page = server.page();
    for bad in ["", "{", "[]", r#"{"do":"everything"}"#, r#"{"do":"race","racers":[]}"#] {
        page.socket.send(Message::text(bad)).unwrap();
        assert_eq!(page.hear("said", |_| true)["level"], "error", "{bad}");
    }
    let beside = json!({ "do": "sample", "x": 8, "y": 0, "pass": 0, "count": 1 });
    page.ask(&beside);
    let said = page.hear("said", |_| true);
    assert!(
        said["what"].as_str().unwrap().contains("there is no pixel 8,0"),
        "{said}"
    );
    let far = json!({ "do": "camera", "origin": [1e300, 0, 0], "target": [0, 0, 0], "up": [0, 1, 0], "focus": null });
    page.ask(&far);
    page.hear("said", |said| said["level"] == "error");
    page.wait_for("done");

    let mut huge = server.page();
    let _ = huge.socket.send(Message::text(" ".repeat(1 << 20)));
    let closed = loop {
        match huge.socket.read() {
            Ok(Message::Close(_)) | Err(_) => break true,
            Ok(Message::Text(text)) if text.contains("not understood") => break false,
            Ok(_) => {}
        }
    };
    assert!(closed, "a message of a mebibyte was read");
    server.page().wait_for("done");
}

#[test]
fn files_written_at_the_goal_have_the_bytes_of_a_render_and_the_page_shows_the_same() {
    let place = Place::new();
    let server = Server::start(&place, "in/small.toml --size 96x70 --spp 13 -o a.exr -o a.png");
    let mut page = server.page();
    page.wait_for("done");
    let said = page.write();
    let command = "octolux render in/small.toml --size 96x70 --spp 13 gives the same bits";
    assert!(
        said.contains("wrote a.exr and a.png") && said.contains(command),
        "{said}"
    );
    place.succeeds("render in/small.toml --size 96x70 --spp 13 -o b.exr -o b.png");
    for ending in ["exr", "png"] {
        let bytes = |name: &str| fs::read(place.path().join(name).with_extension(ending)).unwrap();
        assert!(bytes("a") == bytes("b"), "{ending}");
    }
    page.hear("look", |_| true);
    assert!(page.halves == in_halves(&read_picture(&place.path().join("b.exr")).unwrap()));
}

#[test]
fn files_written_on_the_way_have_the_bytes_of_a_render_of_as_many_samples() {
    let place = Place::new();
    let server = Server::start(&place, "in/small.toml --size 96x70 --estimator light -o a.exr");
    let mut page = server.page();
    page.hear("status", |status| status["picture"]["least"].as_u64() > Some(3));
    page.ask(&json!({ "do": "stop" }));
    page.wait_for("stopped");
    let said = page.write();
    let from = said.find("octolux render").unwrap() + "octolux ".len();
    let command = said[from..].strip_suffix(" gives the same bits").unwrap();
    place.succeeds(&format!("{command} -o b.exr"));
    let bytes = |name: &str| fs::read(place.path().join(name)).unwrap();
    assert!(bytes("a.exr") == bytes("b.exr"), "{command}");
    // It has not ended: more samples come.
    let (_, spp) = command.rsplit_once("--spp ").unwrap();
    let before: u64 = spp.parse().unwrap();
    page.ask(&json!({ "do": "go" }));
    page.hear("status", |status| status["picture"]["least"].as_u64() > Some(before));
}

#[test]
fn a_turned_camera_shows_what_its_table_renders() {
    let place = Place::new();
    let server = Server::start(&place, "in/small.toml --spp 5 -o a.exr");
    let mut page = server.page();
    page.wait_for("done");
    let view = json!({ "do": "camera", "origin": [2, 1.5, 5], "target": [0.25, 0, 0], "up": [0, 1, 0], "focus": null });
    page.ask(&view);
    let status = page.hear("status", |status| status["turned"] == true && status["state"] == "done");
    page.write();
    let table = status["camera"]["table"].as_str().unwrap();
    let scene = fs::read_to_string(place.path().join("in/small.toml")).unwrap();
    let rest = &scene[scene.find("[film]").unwrap()..];
    fs::write(place.path().join("in/turned.toml"), format!("{table}\n{rest}")).unwrap();
    place.succeeds("render in/turned.toml --spp 5 -o b.exr");
    place.succeeds("render in/small.toml --spp 5 -o c.exr");
    let read = |name: &str| read_picture(&place.path().join(name)).unwrap();
    assert!(read("a.exr") == read("b.exr"));
    assert!(read("a.exr") != read("c.exr"), "the camera has turned");
}

#[test]
fn a_sample_is_told_as_replay_tells_it() {
    let place = Place::new();
    let server = Server::start(&place, "in/small.toml --spp 1");
    let mut page = server.page();
    page.wait_for("done");
    page.ask(&json!({ "do": "sample", "x": 4, "y": 2, "pass": 1, "count": 2 }));
    let sample = page.hear("sample", |_| true);
    for (place_of, pass) in [(0, 1), (1, 2)] {
        let line = stdout(&place.succeeds(&format!("render in/small.toml --replay 4,2,{pass} --json")));
        let told: Value = serde_json::from_str(&line).unwrap();
        assert_eq!(in_single(&sample["replays"][place_of]), in_single(&told));
    }
    // One light of radius 0.5 at (0, 3, 2), seen from the point on the ball of radius 1 around 0.
    let cap = &sample["caps"][0];
    let point: Vec<f64> = serde_json::from_value(sample["replays"][0]["point"]["p"].clone()).unwrap();
    let point = [point[0], point[1], point[2] + 6.0];
    let distance = [0, 1, 2]
        .map(|axis: usize| [0.0, 3.0, 2.0][axis] - point[axis])
        .iter()
        .map(|x| x * x)
        .sum::<f64>();
    let cosine = (1.0 - 0.25 / distance).sqrt();
    assert!((cap["cos"].as_f64().unwrap() - cosine).abs() < 1e-12, "{cap}");
}

#[test]
fn a_saved_scene_is_rendered_again_and_an_error_stands_at_its_line() {
    let place = Place::new();
    let server = Server::start(&place, "in/small.toml --spp 1 -o a.exr");
    let mut page = server.page();
    let epoch = page.wait_for("done")["epoch"].as_u64();
    let path = place.path().join("in/small.toml");
    let text = fs::read_to_string(&path).unwrap();
    let broken = text.replace("radius   = 0.5", "radius   = -0.5");
    fs::write(&path, &broken).unwrap();
    let scene = page.hear("scene", |scene| !scene["error"].is_null());
    let line = 1 + broken[..broken.find("-0.5").unwrap()].matches('\n').count();
    assert_eq!(scene["error"]["line"], line);
    assert_eq!(scene["text"], broken);
    fs::write(
        &path,
        text.replace("emission = [10.0, 10.0, 10.0]", "emission = [20.0, 5.0, 10.0]"),
    )
    .unwrap();
    page.hear("scene", |scene| scene["error"].is_null());
    page.hear("status", |status| {
        status["epoch"].as_u64() > epoch && status["state"] == "done"
    });
    page.write();
    place.succeeds("render in/small.toml --spp 1 -o b.exr");
    let read = |name: &str| read_picture(&place.path().join(name)).unwrap();
    assert!(read("a.exr") == read("b.exr"));
}

#[test]
fn four_racers_have_the_same_time_and_their_errors_are_against_the_given_reference() {
    let place = Place::new();
    place.succeeds("render in/small.toml --size 96x70 --seed 9 --spp 256 -o r.exr");
    let server = Server::start(&place, "in/small.toml --size 96x70 --reference r.exr");
    let mut page = server.page();
    let racer =
        |estimator: &str, adaptive: bool| json!({ "estimator": estimator, "sampler": "sobol", "adaptive": adaptive });
    let racers = [
        racer("uniform", false),
        racer("light", false),
        racer("mis", false),
        racer("mis", true),
    ];
    page.ask(&json!({ "do": "race", "racers": racers }));
    let all = |status: &Value| {
        let racers = status["race"]["racers"].as_array();
        racers.is_some_and(|racers| racers.iter().all(|racer| racer["curve"].as_array().unwrap().len() > 2))
    };
    let race = page.hear("status", all)["race"].clone();
    assert!(race["reference"]["ready"] == true && race["reference"]["noise"].is_null());
    let error = |racer: usize| {
        race["racers"][racer]["curve"].as_array().unwrap().last().unwrap()[1]
            .as_f64()
            .unwrap()
    };
    // The light covers a fiftieth of the directions: `uniform` has a variance at least ten times that of `light` for a sample.
    assert!(error(0) > 2.0 * error(1), "{race}");
    assert!((0..4).all(|racer| error(racer) > 0.0 && error(racer).is_finite()));
    page.ask(&json!({ "do": "end-race" }));
    page.hear("status", |status| status["race"].is_null());
}

#[test]
fn what_cannot_be_viewed_is_bad_usage() {
    let place = Place::new();
    let says = |arguments: &str| place.refused(&format!("view --no-open in/small.toml {arguments}"));
    assert!(says("-o a.acc").contains("view writes pictures"));
    assert!(says("-o in/small.toml").contains("in/small.toml"));
    assert!(says("--reference none.exr").contains("none.exr"));
    assert!(says("--size 20000x4").contains("16384"));
    assert!(says("--tev 127.0.0.1:1").contains("--tev 127.0.0.1:1"));
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    assert!(says(&format!("--port {port}")).contains("cannot serve at"));
}
