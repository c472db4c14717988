"""Validation of a tree against settings, whose kinds extensions extend."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, ClassVar, TypeVar, cast, get_args

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, TypeAdapter, ValidationError
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from .extensions import MissingExtensionError, UnusableError, names, provided, provider
from .messages import Steps
from .problems import Problems
from .settings import Settings
from .yamltree import Node, to_python

T = TypeVar("T")


def validated(kind: type[T], root: Node, problems: Problems) -> T | None:
    """Return the settings of a type that a tree states, or None after adding messages."""
    adapter = type_adapter(cast(Any, kind))
    try:
        settings: T = adapter.validate_python(to_python(root))
        return settings
    except ValidationError as error:
        explain_in(problems, error, adapter, root)
        return None


def validated_parts(
    parts: Iterable[tuple[Steps, Any, Node]], problems: Problems
) -> dict[Steps, Any]:
    """Return the valid values of parts of a tree, each a path, a type and a node; faults go to the
    problems.
    """
    values = {}
    for steps, kind, node in parts:
        adapter = type_adapter(kind)
        try:
            values[steps] = adapter.validate_python(to_python(node))
        except ValidationError as error:
            explain_in(problems, error, adapter, node, steps)
        except MissingExtensionError as error:
            problems.add(steps, str(error))
    return values


def explain_in(
    problems: Problems,
    error: ValidationError,
    adapter: TypeAdapter[Any],
    node: Node,
    steps: Steps = (),
) -> None:
    """Add messages about a node at a path."""
    # Most files are right, and wording is the largest module of this room.
    from ._wording import explain

    for explanation in explain(error.errors(include_url=False), node, _schema(adapter)):
        problems.add((*steps, *explanation.steps), explanation.text, explanation.of_key)


@cache
def type_adapter(kind: Any) -> TypeAdapter[Any]:
    """Return the validator of a type of settings, made once."""
    return TypeAdapter(kind)


@cache
def _schema(adapter: TypeAdapter[Any]) -> dict[str, Any]:
    return adapter.json_schema()


# A pydantic union is closed when its class is made, and the kernel imports no extension. So kinds
# are looked up during validation, when a file names one. Pydantic asks an annotation for two
# things: the first hook wraps the validator of the kernel's union, which stays in charge of the
# kinds that it has, the second extends its JSON schema, for `ballplate schema` and for messages.
# Faults within an extension's settings are reported as those of the kernel's are, since its own
# class validates them.
@dataclass(frozen=True)
class OpenKinds:
    """Annotation of a union, or of `base` where the kernel has no kinds: values of `kind` that it
    lacks are looked up among names that extensions provide under `provided`.

    `base` is the class of their settings; `form` returns the class that the union needs.
    """

    discriminator: ClassVar[str] = "kind"

    provided: str
    base: type[Settings] = Settings
    form: Callable[[Any], Any] = lambda settings: settings

    def settings(self, kind: str) -> Any | None:
        """Return an extension's settings of a kind, or None.

        :raises UnusableError: the extension lacks them.
        """
        settings = provided(self.provided, kind, "SETTINGS")
        if settings is None:
            return None
        is_right = isinstance(settings, type) and issubclass(settings, self.base)
        if not is_right or get_args(settings.model_fields["kind"].annotation) != (kind,):
            extension = provider(self.provided, kind)
            assert extension is not None
            text = f"is no {self.base.__name__} with kind: Literal[{kind!r}]"
            raise UnusableError(f"extension {extension.name}: SETTINGS of {kind} {text}")
        return self.form(settings)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        # The kernel's kinds, if any, are discriminated here, since a field would do so only
        # afterwards.
        if source is not self.base:
            of_kernel = handler.generate_schema(Annotated[source, Field(discriminator="kind")])
            return core_schema.no_info_wrap_validator_function(self._validated, of_kernel)
        # An empty union has nothing to write.
        return core_schema.no_info_wrap_validator_function(
            self._validated,
            core_schema.tagged_union_schema({}, self.discriminator),
            serialization=core_schema.simple_ser_schema("any"),
        )

    def _validated(self, value: Any, of_kernel: Callable[[Any], Any]) -> Any:
        try:
            return of_kernel(value)
        except ValidationError as refusal:
            # Only an unknown kind of this very value: with a location, it is one of a union further
            # down, in a kind that the kernel has.
            (first, *_) = refusal.errors(include_url=False, include_input=False)
            if first["type"] != "union_tag_invalid" or first["loc"]:
                raise
        settings = self.settings(str(value["kind"]))
        if settings is None:
            raise PydanticCustomError("open_tag_invalid", "unknown kind")
        return settings.model_validate(value)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        union_schema = handler(schema)
        additions: list[Any] = []
        for kind in names(self.provided, with_registered=True):
            # Kinds of a shipped extension that is not installed are left out of the schema.
            with suppress(MissingExtensionError):
                additions.append(self.settings(kind))
        for settings in additions:
            # Pydantic may have deferred a class's schema.
            settings.model_rebuild()
        if additions:
            # As members of a union their own models are added to the definitions.
            union = core_schema.union_schema(
                [settings_class.__pydantic_core_schema__ for settings_class in additions]
            )
            extension_schema = handler(union)
            union_schema.setdefault("oneOf", []).extend(
                extension_schema.get("anyOf", [extension_schema])
            )
        return union_schema
