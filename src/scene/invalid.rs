//! Why a scene cannot be built.

use std::borrow::Cow;
use std::fmt;

/// A part of a scene. Numbers are indices into the builder's lists, from 0; in messages shapes count from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Subject {
    /// The camera.
    Camera,
    /// The size of the picture.
    Film,
    /// The render settings.
    Render,
    /// A material.
    Material(usize),
    /// A sphere.
    Sphere(usize),
    /// A mesh.
    Mesh(usize),
    /// A light without shape.
    Light(usize),
    /// The environment.
    Environment,
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Camera => f.write_str("camera"),
            Self::Film => f.write_str("film"),
            Self::Render => f.write_str("render"),
            Self::Material(index) => write!(f, "material {}", index + 1),
            Self::Sphere(index) => write!(f, "sphere {}", index + 1),
            Self::Mesh(index) => write!(f, "mesh {}", index + 1),
            Self::Light(index) => write!(f, "light {}", index + 1),
            Self::Environment => f.write_str("environment"),
        }
    }
}

/// The invalid property of a subject.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Property {
    /// Its key in a scene file: `radius`, `vertices`, `exponent`.
    pub key: &'static str,
    /// Its index in a list, from 0.
    pub index: Option<usize>,
    /// Its component in a vector or a colour, from 0.
    pub component: Option<usize>,
}

/// A problem without its subject.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Wrong {
    property: Option<Property>,
    problem: Cow<'static, str>,
    value: Option<String>,
    remedy: Cow<'static, str>,
}

impl Wrong {
    /// A problem of a subject as a whole; `problem` follows its name, as in "has no faces".
    pub fn new(problem: impl Into<Cow<'static, str>>, remedy: impl Into<Cow<'static, str>>) -> Self {
        Self {
            property: None,
            problem: problem.into(),
            value: None,
            remedy: remedy.into(),
        }
    }

    /// Adds the invalid property and its value.
    pub fn of(mut self, property: Property, value: impl fmt::Display) -> Self {
        self.property = Some(property);
        self.value = Some(value.to_string());
        self
    }

    /// Adds the subject with its name, which may be empty.
    pub fn on(self, subject: Subject, name: &str) -> InvalidScene {
        InvalidScene(Box::new((subject, name.to_owned(), self)))
    }
}

/// The error of an invalid scene: the part, the rule, the value and a remedy.
///
/// `Display` is one line: `sphere 3 radius must be positive and finite, got -0.5`.
#[derive(Clone, PartialEq, Eq)]
pub struct InvalidScene(Box<(Subject, String, Wrong)>);

impl InvalidScene {
    /// The part of the scene.
    pub fn subject(&self) -> Subject {
        self.0.0
    }

    /// The name of the part, or its kind and number.
    pub fn name(&self) -> String {
        match (self.0.0, self.0.1.as_str()) {
            (subject, "") => subject.to_string(),
            (Subject::Material(_), name) => format!("material \"{name}\""),
            (_, name) => name.to_owned(),
        }
    }

    /// The invalid property; `None` if the part is invalid as a whole.
    pub fn property(&self) -> Option<Property> {
        self.0.2.property
    }

    /// The problem without the subject: `must be positive and finite`.
    pub fn problem(&self) -> &str {
        &self.0.2.problem
    }

    /// The invalid value, abbreviated; `None` if there is no single one.
    pub fn value(&self) -> Option<&str> {
        self.0.2.value.as_deref()
    }

    /// The remedy, in one line.
    pub fn remedy(&self) -> &str {
        &self.0.2.remedy
    }
}

impl fmt::Display for InvalidScene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name())?;
        if let Some(Property { key, index, .. }) = self.0.2.property {
            write!(f, " {key}")?;
            if let Some(index) = index {
                write!(f, "[{index}]")?;
            }
        }
        write!(f, " {}", self.0.2.problem)?;
        self.0
            .2
            .value
            .as_ref()
            .map_or(Ok(()), |value| write!(f, ", got {value}"))
    }
}

/// `Display` with the remedy: a test that unwraps shows both.
impl fmt::Debug for InvalidScene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self} (help: {})", self.0.2.remedy)
    }
}

impl std::error::Error for InvalidScene {}
