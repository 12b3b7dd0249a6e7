//! Selects the picture in an EXR file: parts contain channels, whose names begin with that of a layer.

use std::collections::BTreeMap;

use exr::meta::header::Header;

use super::super::Problem;

/// Representation of colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Red, green and blue.
    Colours,
    /// Luminance only.
    Grey,
    /// Luminance and two chroma differences, `RY` and `BY`.
    Chroma,
}

/// One picture of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Layer {
    /// Index of its part, from 0.
    pub part: usize,
    /// Name of its part.
    part_name: Option<String>,
    /// The prefix of its channels, up to the last dot.
    prefix: String,
    pub kind: Kind,
    /// Red, green, blue; or luminance, `RY` and `BY`: indices into the part's channels.
    pub channels: [usize; 3],
}

impl Layer {
    /// Its name for the key `layer`.
    fn name(&self) -> String {
        match (&self.part_name, self.prefix.as_str()) {
            (part, "") => part.clone().unwrap_or_default(),
            (Some(part), prefix) if part != prefix => format!("{part}.{prefix}"),
            (_, prefix) => prefix.to_owned(),
        }
    }

    fn is_called(&self, name: &str) -> bool {
        self.name() == name || self.prefix == name || self.part_name.as_deref() == Some(name)
    }
}

/// The named layer, or the default one without a name; and a note for the user if others are possible.
pub(super) fn choose(headers: &[Header], called: Option<&str>) -> Result<(Layer, Option<String>), Problem> {
    let all: Vec<Layer> = (0..)
        .zip(headers)
        .flat_map(|(part, header)| layers(part, header))
        .collect();
    let names = |layers: &[&Layer]| {
        let names = layers.iter().map(|layer| layer.name()).filter(|name| !name.is_empty());
        names.map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
    };
    let every: Vec<&Layer> = all.iter().collect();
    if let Some(name) = called {
        let fitting: Vec<&Layer> = all.iter().filter(|layer| layer.is_called(name)).collect();
        // A part and one of its layers may share a name: a match of the full name wins.
        let whole: Vec<&Layer> = fitting.iter().copied().filter(|layer| layer.name() == name).collect();
        return match (&fitting[..], &whole[..]) {
            ([one], _) | (_, [one]) => Ok(((*one).clone(), None)),
            ([], _) => Err(Problem::new(
                format!("has no layer \"{name}\""),
                choices(&names(&every)),
            )),
            _ => Err(Problem::new(
                format!("has several layers \"{name}\""),
                choices(&names(&fitting)),
            )),
        };
    }
    if headers.iter().all(|header| header.deep) {
        return Err(Problem::new(
            "holds deep data, samples at many depths",
            "flatten it to one colour a pixel",
        ));
    }
    let plain: Vec<&Layer> = all.iter().filter(|layer| layer.prefix.is_empty()).collect();
    match (&plain[..], &every[..]) {
        ([one], _) | ([], [one]) => Ok(((*one).clone(), None)),
        ([first, ..], _) => {
            let note = format!(
                "holds the pictures {}: the first is read, layer = \"...\" reads another",
                names(&plain)
            );
            Ok(((*first).clone(), Some(note)))
        }
        ([], []) => {
            let channels = headers.iter().flat_map(|header| &header.channels.list);
            let channels: Vec<String> = channels.take(20).map(|channel| channel.name.to_string()).collect();
            Err(Problem::new(
                format!("holds no picture: its channels are {}", channels.join(", ")),
                "save it with the channels R, G and B, or Y",
            ))
        }
        ([], _) => Err(Problem::new(
            "holds several layers, and none of them is the picture",
            choices(&names(&every)),
        )),
    }
}

fn choices(names: &str) -> String {
    if names.is_empty() {
        "leave layer out: the file has one picture without a name".to_owned()
    } else {
        format!("say which with layer = \"...\", one of {names}")
    }
}

/// The pictures of a part.
fn layers(part: usize, header: &Header) -> Vec<Layer> {
    if header.deep {
        return Vec::new();
    }
    let mut groups: BTreeMap<String, Vec<(String, usize)>> = BTreeMap::new();
    for (index, channel) in header.channels.list.iter().enumerate() {
        let name = channel.name.to_string();
        let (prefix, own) = name.rsplit_once('.').unwrap_or(("", &name));
        groups
            .entry(prefix.to_owned())
            .or_default()
            .push((own.to_ascii_uppercase(), index));
    }
    let part_name = header.own_attributes.layer_name.as_ref().map(ToString::to_string);
    let part_name = part_name.filter(|name| !name.is_empty());
    let layer = |(prefix, channels): (String, Vec<(String, usize)>)| {
        let named = |name: &str| channels.iter().find(|(own, _)| own == name).map(|(_, index)| *index);
        let three = |[a, b, c]: [&str; 3]| Some([named(a)?, named(b)?, named(c)?]);
        let colours = three(["R", "G", "B"]).or_else(|| three(["RED", "GREEN", "BLUE"]));
        // X, Y and Z together are a point or a direction.
        let luminance = named("Y").filter(|_| named("X").is_none() && named("Z").is_none());
        let (kind, channels) = match (colours, luminance, three(["Y", "RY", "BY"])) {
            (Some(colours), ..) => (Kind::Colours, colours),
            (_, Some(_), Some(chroma)) => (Kind::Chroma, chroma),
            (_, Some(y), _) => (Kind::Grey, [y; 3]),
            _ => return None,
        };
        Some(Layer {
            part,
            part_name: part_name.clone(),
            prefix,
            kind,
            channels,
        })
    };
    groups.into_iter().filter_map(layer).collect()
}
