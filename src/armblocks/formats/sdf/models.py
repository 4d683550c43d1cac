"""Models of SDF files with the models that they include."""

from __future__ import annotations

import re
from pathlib import Path, PurePath

from armblocks.errors import ArmblocksError
from armblocks.files import read_bounded
from armblocks.formats.file_findings import FileContext
from armblocks.formats.referenced_files import resolved
from armblocks.formats.sdf.frames import Frame, Scope, Source
from armblocks.formats.sdf.rules import MODEL
from armblocks.formats.sdf.values import flag_in, is_true, text_in
from armblocks.formats.xml_elements import Element, note, read_elements, shortened

MAX_BYTES = 16 * 2**20
"""Maximum size of an included file."""
MAX_INCLUDES = 200
"""Maximum number of models that a file includes, directly and indirectly."""
MAX_LEVELS = 16
"""Maximum nesting of models."""
LATEST = (1, 12)
_MANIFEST_BYTES = 100_000


def source_of(root: Element, folder: Path | None) -> Source:
    """Version and folder of a file. Raises ``FormatError`` if it is not SDF."""
    if root.tag not in ("sdf", "gazebo"):
        raise root.error(
            f"the root element is <{shortened(root.tag)}>",
            allowed="<sdf version=…>: an SDF file",
            fix="check the format of the file; URDF and MJCF are not SDF",
        )
    text = root.attributes.get("version", "").strip()
    match = re.fullmatch(r"([0-9]{1,3})\.([0-9]{1,3})(\..*)?", text)
    if text and match is None:
        raise root.error(f"the version is '{shortened(text)}'", allowed="a version such as 1.9")
    return Source((int(match[1]), int(match[2])) if match else LATEST, folder)


class Models:
    """Reads the models of a file into scopes, and includes other files, which are read once."""

    def __init__(self, context: FileContext) -> None:
        self.context = context
        self.errors: list[ArmblocksError] = []
        self._files: dict[Path, Element] = {}
        self._includes = 0

    def world(self, element: Element, source: Source) -> Scope:
        """The models in a ``<world>``, or in the root element of a file without a world.

        If a model of a world cannot be read, a finding states the reason, and the error is added to
        ``errors``.
        """
        scope = Scope()
        scope.frame = Frame(kind="world", name="world", element=element, source=source, scope=scope)
        for child in element.children:
            try:
                self._add(child, scope, scope.frame, source, 0)
            except ArmblocksError as error:
                self.errors.append(error)
                if element.tag == "world":
                    self.refused(child, error)
        return scope

    def refused(self, element: Element, error: ArmblocksError) -> None:
        """Add the finding for a model of a world that cannot be read."""
        place = error.where.partition(", ")[0]
        elsewhere = "" if place == element.where.partition(", ")[0] else f"{place}: "
        note(self.context, MODEL, element, f"it is not read: {elsewhere}{error.what}")

    def _add(self, child: Element, scope: Scope, model_frame: Frame, source: Source, level: int) -> None:
        """Add the frames of an element of a model or world."""
        in_world = scope.frame.kind == "world"
        if child.tag in ("link", "joint") and in_world:
            if child.tag == "joint":
                raise child.error("joints between models are not supported", allowed="joints inside a model")
            return
        if child.tag in ("link", "joint", "frame"):
            name = child.required("name", "a name that is not empty")
            frame = Frame(
                kind=child.tag,
                name=scope.prefix + name,
                element=child,
                source=source,
                scope=scope,
                model_frame=None if in_world else model_frame,
                pose=child.first("pose") or child.first("origin"),
            )
            scope.add(name, frame)
        elif child.tag == "model":
            self._model(child, None, scope, model_frame, (source, source), level)
        elif child.tag == "include":
            self._include(child, scope, model_frame, source, level)

    def _model(
        self,
        model: Element,
        include: Element | None,
        scope: Scope,
        model_frame: Frame,
        sources: tuple[Source, Source],
        level: int,
    ) -> None:
        """Add a model, or the model of an included file, to a scope.

        ``sources``: the sources of the element that places the model, and of the model.
        """
        if level >= MAX_LEVELS:
            raise model.error(
                "models are nested too deeply, or include themselves", allowed=f"at most {MAX_LEVELS} levels"
            )
        name = (text_in(include, "name") if include else "") or model.required("name", "a name")
        placement = model.attributes.get("placement_frame", "").strip()
        pose, static = model.first("pose"), flag_in(model, "static")
        if include is not None:
            static = flag_in(include, "static") if include.first("static") is not None else static
            if include.first("pose") is not None:
                pose, placement = include.first("pose"), text_in(include, "placement_frame") or placement
        merged = include is not None and is_true(include, include.attributes.get("merge", ""))
        if merged and scope.frame.kind == "world":
            raise model.error("a model cannot be merged into a world", allowed="merge inside a model")
        in_world = scope.frame.kind == "world"
        frame = Frame(
            kind="merged" if merged else "model",
            name=scope.prefix + name,
            element=model,
            source=sources[0],
            scope=scope,
            model_frame=None if in_world else model_frame,
            pose=pose,
            placement=placement,
        )
        scope.add(f"_merged__{name}__model__" if merged else name, frame)
        inner = scope
        if not merged:
            inner = Scope(
                prefix="" if in_world else f"{frame.name}::",
                fixed=scope.fixed or static,
                canonical=model.attributes.get("canonical_link", "").strip(),
            )
            inner.frame, frame.inner = frame, inner
        for child in model.children:
            self._add(child, inner, frame, sources[1], level + 1)

    def _include(
        self, include: Element, scope: Scope, model_frame: Frame, source: Source, level: int
    ) -> None:
        self._includes += 1
        if self._includes > MAX_INCLUDES or level >= MAX_LEVELS:
            raise include.error(
                "the file includes too many models, or they include themselves",
                allowed=f"{MAX_INCLUDES} models, {MAX_LEVELS} levels",
                fix="split the file",
            )
        uri = text_in(include, "uri")
        path = self._file(uri, source.folder)
        if isinstance(path, str):
            raise include.error(
                f"the included model '{shortened(uri)}' is not read: {path}",
                allowed="model://name, package://name or a path",
                fix="give the folder of the model with packages={name: folder}",
            )
        if path not in self._files:
            self._files[path] = read_elements(read_bounded(path, MAX_BYTES), str(path))
        root = self._files[path]
        inside = source_of(root, path.parent)
        models = [*root.all("model")]
        if not models and (root.first("light") or root.first("actor")):
            return
        if len(models) != 1:
            raise root.error(f"the included file has {len(models)} models", allowed="one model")
        self._model(models[0], include, scope, model_frame, (source, inside), level)

    def _file(self, uri: str, folder: Path | None) -> Path | str:
        """The SDF file of a URI, or the reason why there is none."""
        if not uri:
            return "the <uri> is empty"
        suffix = PurePath(uri).suffix.lower()
        if suffix in (".sdf", ".world"):
            return resolved(uri, self.context, folder)
        if suffix in (".urdf", ".xacro", ".xml"):
            return f"'{suffix}' files are not included"
        uri = uri.rstrip("/")
        manifest = resolved(f"{uri}/model.config", self.context, folder)
        if isinstance(manifest, Path):
            sdf_elements = read_elements(read_bounded(manifest, _MANIFEST_BYTES), str(manifest)).all("sdf")
            files = sorted((_version(entry), entry.text) for entry in sdf_elements)
            if files:
                return resolved(files[-1][1], self.context, manifest.parent)
        path = resolved(f"{uri}/model.sdf", self.context, folder)
        return path if isinstance(path, Path) else manifest if isinstance(manifest, str) else path


def _version(entry: Element) -> tuple[int, ...]:
    words = re.findall(r"[0-9]{1,3}", entry.attributes.get("version", ""))
    return tuple(int(word) for word in words)
