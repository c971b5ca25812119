//! Scene files: a shape with its camera, lights and colours, as versioned JSON.
//!
//! Strict, because a file may come from a stranger and because a misspelt key must not be a silent
//! default: unknown and duplicate keys, NaN, other versions and absurd sizes are refused, with the
//! path of the value. The format is described in docs/. Law: every op reads back bit for bit.

use sdfrs_core::{
    FormatError, SceneError, Shape,
    file::{Fields, Json, MAX_NODES, nodes_to_json, shape_from_nodes},
};
use sdfrs_trace::{
    camera::{Camera, Kind},
    shade::{PointLight, Surface},
};

/// The version written, and the only one read.
pub const VERSION: u64 = 1;
/// Most lights of one file.
pub const MAX_LIGHTS: usize = 1024;

/// What a file holds; what it leaves out is None.
#[derive(Debug, Clone)]
pub struct SceneFile {
    pub shape: Shape,
    pub camera: Option<Camera>,
    pub lights: Option<Vec<PointLight>>,
    pub background: Option<[f64; 3]>,
    pub albedo: Option<[f64; 3]>,
}

impl SceneFile {
    /// A file of a shape alone.
    pub fn new(shape: Shape) -> Self {
        Self { shape, camera: None, lights: None, background: None, albedo: None }
    }

    /// The colours, defaults filled in.
    pub fn surface(&self) -> Surface {
        let default = Surface::default();
        Surface {
            albedo: self.albedo.unwrap_or(default.albedo),
            background: self.background.unwrap_or(default.background),
        }
    }

    /// Reads a whole file.
    pub fn parse(text: &str) -> Result<SceneFile, FormatError> {
        let json = Json::parse(text)?;
        let mut fields = Fields::of(&json, "")?;
        let (version, at) = fields.required("sdfrs")?;
        if *version != Json::Int(VERSION as i64) {
            let message = format!("got version {}, allowed: {VERSION}", version.describe());
            return Err(FormatError::new(at, message));
        }
        let (nodes, nodes_at) = fields.required("nodes")?;
        let (root, root_at) = fields.required("root")?;
        let camera = fields.optional("camera");
        let lights = fields.optional("lights");
        let background = fields.optional("background");
        let albedo = fields.optional("albedo");
        fields.finish("sdfrs, nodes, root, camera, lights, background, albedo")?;

        let root = root.as_count(&root_at, MAX_NODES as u64)? as usize;
        let file = SceneFile {
            shape: shape_from_nodes(nodes.as_list(&nodes_at)?, root)?,
            camera: camera.map(|(json, at)| camera_from_json(json, &at)).transpose()?,
            lights: lights.map(|(json, at)| lights_from_json(json, &at)).transpose()?,
            background: background.map(|(json, at)| json.as_vec3(&at)).transpose()?,
            albedo: albedo.map(|(json, at)| json.as_vec3(&at)).transpose()?,
        };
        if file.shape.is_expr() {
            let message = format!("node {root} is an expression (`{}`), allowed: a shape", file.shape.op());
            return Err(FormatError::new("root", message));
        }
        file.surface().check().map_err(|e| FormatError::new(e.op, e.message))?;
        Ok(file)
    }

    /// The text of a file, one node a line.
    pub fn to_json_string(&self) -> String {
        let nodes = nodes_to_json(&self.shape);
        let root = nodes.len() - 1;
        let mut out = format!("{{\n\"sdfrs\": {VERSION},\n\"nodes\": [\n");
        for (i, node) in nodes.iter().enumerate() {
            out.push_str("  ");
            out.push_str(&node.to_line());
            out.push_str(if i == root { "\n" } else { ",\n" });
        }
        out.push_str(&format!("],\n\"root\": {root}"));
        let lights = self.lights.as_ref().map(|l| Json::List(l.iter().map(light_to_json).collect()));
        let rest = [
            ("camera", self.camera.as_ref().map(camera_to_json)),
            ("lights", lights),
            ("background", self.background.map(Json::vec3)),
            ("albedo", self.albedo.map(Json::vec3)),
        ];
        for (key, value) in rest.into_iter().filter_map(|(key, value)| Some((key, value?))) {
            out.push_str(&format!(",\n\"{key}\": {}", value.to_line()));
        }
        out.push_str("\n}\n");
        out
    }
}

fn camera_to_json(camera: &Camera) -> Json {
    let (kind, name, value) = match camera.kind {
        Kind::Pinhole { fov_deg } => ("pinhole", "fov", fov_deg),
        Kind::Orthographic { extent } => ("orthographic", "extent", extent),
    };
    Json::object([
        ("kind", Json::text(kind)),
        ("origin", Json::vec3(camera.origin)),
        ("target", Json::vec3(camera.target)),
        ("up", Json::vec3(camera.up)),
        (name, Json::Num(value)),
        ("width", Json::Int(camera.width.into())),
        ("height", Json::Int(camera.height.into())),
    ])
}

fn camera_from_json(json: &Json, path: &str) -> Result<Camera, FormatError> {
    let mut fields = Fields::of(json, path)?;
    let (kind, at) = fields.required("kind")?;
    let name = match kind.as_text(&at)? {
        "pinhole" => "fov",
        "orthographic" => "extent",
        _ => {
            let message = format!("got {}, allowed: \"pinhole\" or \"orthographic\"", kind.describe());
            return Err(FormatError::new(at, message));
        }
    };
    let (value, at) = fields.required(name)?;
    let value = value.as_number(&at)?;
    let kind =
        if name == "fov" { Kind::Pinhole { fov_deg: value } } else { Kind::Orthographic { extent: value } };
    let [origin, target, up] = ["origin", "target", "up"].map(|name| {
        let (json, at) = fields.required(name)?;
        json.as_vec3(&at)
    });
    let [width, height] = ["width", "height"].map(|name| {
        let (json, at) = fields.required(name)?;
        // The camera's own check knows the real limits; this one is for the type.
        json.as_count(&at, u64::from(u32::MAX)).map(|v| v as u32)
    });
    let camera = Camera { kind, origin: origin?, target: target?, up: up?, width: width?, height: height? };
    fields.finish(&format!("kind, origin, target, up, {name}, width, height"))?;
    camera.check().map_err(|e| within(path, &e))?;
    Ok(camera)
}

fn light_to_json(light: &PointLight) -> Json {
    Json::object([
        ("position", Json::vec3(light.position)),
        ("color", Json::vec3(light.color)),
        ("intensity", Json::Num(light.intensity)),
    ])
}

fn lights_from_json(json: &Json, path: &str) -> Result<Vec<PointLight>, FormatError> {
    let list = json.as_list(path)?;
    if list.len() > MAX_LIGHTS {
        return Err(FormatError::new(
            path,
            format!("got {} lights, allowed: up to {MAX_LIGHTS}", list.len()),
        ));
    }
    list.iter().enumerate().map(|(i, item)| light_from_json(item, &format!("{path}[{i}]"))).collect()
}

fn light_from_json(json: &Json, path: &str) -> Result<PointLight, FormatError> {
    let mut fields = Fields::of(json, path)?;
    let (position, at) = fields.required("position")?;
    let mut light = PointLight::at(position.as_vec3(&at)?);
    if let Some((color, at)) = fields.optional("color") {
        light.color = color.as_vec3(&at)?;
    }
    if let Some((intensity, at)) = fields.optional("intensity") {
        light.intensity = intensity.as_number(&at)?;
    }
    fields.finish("position, color, intensity")?;
    light.check().map_err(|e| within(path, &e))?;
    Ok(light)
}

/// An error of `camera fov` or `light color` inside the object at `path`.
fn within(path: &str, error: &SceneError) -> FormatError {
    match error.op.split_once(' ') {
        Some((_, "image")) | None => FormatError::new(path, error.message.clone()),
        Some((_, key)) => FormatError::new(format!("{path}.{key}"), error.message.clone()),
    }
}
