"""The pages of `wsm view` and what they ask for, as a Starlette application."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp

from wsm_data.errors import ConfigError, DataError, IntegrityError, StoreError
from wsm_data.view.browser.clip_query import MAX_LIMIT, parse_query, whole_number
from wsm_data.view.browser.compare import Comparison
from wsm_data.view.browser.guards import Guarded
from wsm_data.view.browser.refusals import Refusals, named_frame
from wsm_data.view.browser.release_shelf import ReleaseShelf
from wsm_data.view.browser.source_shelf import SourceShelf

PAGES = ("grid", "clip", "refused", "compare", "source")
_SCRIPTS = ("page", *PAGES)
_LISTED = 50
_OTHER, _DAMAGED = "other", "damaged"
_JPEG, _PNG = "image/jpeg", "image/png"
_STATUS = ((ConfigError, 404), (DataError, 422), (IntegrityError, 422), (StoreError, 502))


@dataclass(frozen=True, kw_only=True)
class Shown:
    """What is shown.

    Attributes:
        title: what it is called.
        release: a release, or none.
        other: another that is shown beside it.
        source: the source, where it is at hand.
        refusals: lines of the quarantine, or of those of a run.
    """

    title: str
    release: ReleaseShelf | None = None
    other: ReleaseShelf | None = None
    source: SourceShelf | None = None
    refusals: Sequence[Mapping[str, object]] = ()


def view_app(shown: Shown) -> ASGIApp:
    """The application. It reads only, and answers to the names of this machine only."""
    answers = _Answers(shown)
    api: dict[str, Callable[[Request], Response]] = {
        "about": answers.about,
        "clips": answers.clips,
        "around": answers.around,
        "clip": answers.clip,
        "thumbnail": answers.thumbnail,
        "frame": answers.frame,
        "map": answers.map,
        "refusals": answers.refusals,
        "refusal/frame": answers.refusal_frame,
        "compare": answers.compare,
        "containers": answers.containers,
        "container": answers.container,
        "episode": answers.episode,
        "episode/frame": answers.episode_frame,
        "episode/thumbnail": answers.episode_thumbnail,
    }
    routes = [Route(f"/api/{name}", answer) for name, answer in api.items()]
    routes += [Route(path, _file(name, kind)) for path, name, kind in _static(shown)]
    handlers: dict[Any, Any] = {kind: _told(status) for kind, status in _STATUS}
    return Guarded(Starlette(routes=routes, exception_handlers=handlers))


def _static(shown: Shown) -> list[tuple[str, str, str]]:
    """Address, file and type of everything that stands in the package; there is no way to any other file."""
    first = "grid" if shown.release else "source" if shown.source else "refused"
    return [
        ("/", f"{first}.html", "text/html"),
        *((f"/{name}", f"{name}.html", "text/html") for name in PAGES),
        *((f"/static/{name}.js", f"{name}.js", "text/javascript") for name in _SCRIPTS),
        ("/static/browser.css", "browser.css", "text/css"),
        ("/static/icon.svg", "icon.svg", "image/svg+xml"),
    ]


def _file(name: str, kind: str) -> Callable[[Request], Response]:
    content = (files("wsm_data.view.browser") / "static" / name).read_bytes()

    def answer(_request: Request) -> Response:
        return Response(content, media_type=kind, headers={"cache-control": "no-cache"})

    return answer


def _told(status: int) -> Callable[[Request, Exception], Response]:
    def answer(_request: Request, error: Exception) -> Response:
        return JSONResponse({"error": str(error)}, status_code=status)

    return answer


class _Answers:
    """An answer to each address; Starlette calls them in threads."""

    def __init__(self, shown: Shown) -> None:
        self._shown = shown
        self._refusals = Refusals(shown.refusals)
        self._comparison: Comparison | None = None
        if shown.release and shown.other:
            self._comparison = Comparison(shown.release.release, shown.other.release)

    def about(self, _request: Request) -> Response:
        shown = self._shown
        return JSONResponse(
            {
                "title": shown.title,
                "release": shown.release and shown.release.about(),
                "other": shown.other and shown.other.about(),
                "source": shown.source and shown.source.about(),
                "refusals": len(self._refusals),
                "reasons": self._refusals.reasons(),
            }
        )

    def clips(self, request: Request) -> Response:
        shelf = self._shelf(request)
        # In the background and after the list, which would be late while kernels are compiled.
        return JSONResponse(shelf.clips(parse_query(request.query_params)), background=BackgroundTask(shelf.warm_up))

    def around(self, request: Request) -> Response:
        return JSONResponse(self._shelf(request).around(_word(request, "key"), parse_query(request.query_params)))

    def clip(self, request: Request) -> Response:
        return JSONResponse(self._shelf(request).page(_word(request, "key")))

    def thumbnail(self, request: Request) -> Response:
        return _picture(self._shelf(request).thumbnail(_word(request, "key")), _JPEG)

    def frame(self, request: Request) -> Response:
        number = whole_number(request.query_params, "number", 0)
        return _picture(self._shelf(request).frame(_word(request, "key"), _word(request, "kind"), number), _JPEG)

    def map(self, request: Request) -> Response:
        return _picture(self._shelf(request).map_png(_word(request, "key")), _PNG)

    def refusals(self, request: Request) -> Response:
        words = request.query_params
        found = self._refusals.listed(reason=words.get("reason", ""), text=words.get("text", ""), **_paging(request))
        return JSONResponse(found)

    def refusal_frame(self, request: Request) -> Response:
        line = self._refusals.line(whole_number(request.query_params, "number", 0))
        unit, source = str(line["unit"]), self._source()
        if _word(request, "kind") == _DAMAGED:
            return _picture(source.damaged(str(line.get("message", ""))), _JPEG)
        place = source.place_of(unit, str(line.get("source", "")))
        if place is None:
            raise ConfigError(f"{unit} could not be read as a trajectory, so there is no frame of it to show")
        frame = whole_number(request.query_params, "frame", named_frame(line) or 0)
        return _picture(source.frame(*place, _word(request, "kind") or "rgb", frame), _JPEG)

    def compare(self, request: Request) -> Response:
        if self._comparison is None:
            raise ConfigError("there is one release; name another with `wsm view RELEASE --beside OTHER`")
        if not _word(request, "where"):
            return JSONResponse(self._comparison.about())
        found = self._comparison.listed(_word(request, "where"), _word(request, "text"), **_paging(request))
        return JSONResponse(found)

    def containers(self, request: Request) -> Response:
        return JSONResponse(self._source().containers(_word(request, "text"), **_paging(request)))

    def container(self, request: Request) -> Response:
        return JSONResponse(self._source().container(_word(request, "container")))

    def episode(self, request: Request) -> Response:
        return JSONResponse(self._source().page(_word(request, "container"), _word(request, "key")))

    def episode_frame(self, request: Request) -> Response:
        number, source = whole_number(request.query_params, "number", 0), self._source()
        place = (_word(request, "container"), _word(request, "key"))
        return _picture(source.frame(*place, _word(request, "kind"), number), _JPEG)

    def episode_thumbnail(self, request: Request) -> Response:
        return _picture(self._source().thumbnail(_word(request, "container"), _word(request, "key")), _JPEG)

    def _shelf(self, request: Request) -> ReleaseShelf:
        side = _word(request, "side")
        shelf = self._shown.other if side == _OTHER else self._shown.release
        if shelf is None:
            raise ConfigError(f"there is no {'other ' if side == _OTHER else ''}release here")
        return shelf

    def _source(self) -> SourceShelf:
        if self._shown.source is None:
            raise ConfigError("the source is not at hand; `wsm view RUN` shows a release with the source it came from")
        return self._shown.source


def _word(request: Request, name: str) -> str:
    return request.query_params.get(name, "")


def _paging(request: Request) -> dict[str, int]:
    offset, limit = (whole_number(request.query_params, *one) for one in (("offset", 0), ("limit", _LISTED)))
    return {"offset": offset, "limit": min(limit, MAX_LIMIT)}


def _picture(data: bytes, kind: str) -> Response:
    return Response(data, media_type=kind, headers={"cache-control": "no-cache"})
