"""Files put into S3: in parts, each with its MD5, completed, and compared with what the store says of the whole.

What was uploaded of a file before a kill is found by the list of unfinished uploads of its key, and goes on from there;
others of that key are given up, so that nobody pays for parts that belong to nothing.
"""

from collections.abc import Mapping
from typing import Any

from wsm_data.errors import StoreError
from wsm_data.files.retries import NOT_THERE
from wsm_data.files.uploads.fsspec_target import FsspecTarget, differs
from wsm_data.files.uploads.local_file import LocalFile


class S3Target(FsspecTarget):
    """A folder of a bucket."""

    def holds(self, name: str, file: LocalFile) -> bool:
        """Whether the store has exactly these bytes: by its ETag, or by reading them where that is no MD5 of them."""
        stated = self._stated(name)
        if stated is None or stated["size"] != file.size_bytes:
            return False
        return _etag(stated) == file.etag or super().holds(name, file)

    def put(self, name: str, file: LocalFile) -> None:
        """Upload a file; one of several parts goes on where an earlier upload of it was cut.

        Raises:
            StoreError: the store refuses, failed in all attempts, or holds other bytes afterwards.
        """
        if len(file.part_md5s) == 1:
            body = file.part(0)
            self._call("put_object", name, len(body), Body=body, ContentMD5=file.content_md5(0))
        else:
            self._put_parts(name, file)
        if not self.holds(name, file):
            raise differs(self.store, name, file)

    def checksum(self, name: str) -> str:
        """The ETag of a file: another one, other bytes."""
        stated = self._stated(name)
        return f"etag:{_etag(stated)}" if stated else ""

    def _put_parts(self, name: str, file: LocalFile) -> None:
        upload, stored = self._unfinished(name, file)
        for number, md5 in enumerate(file.part_md5s):
            if stored.get(number + 1) != md5.hex():
                body = file.part(number)
                self._call(
                    "upload_part",
                    name,
                    len(body),
                    UploadId=upload,
                    PartNumber=number + 1,
                    Body=body,
                    ContentMD5=file.content_md5(number),
                )
        parts = [{"PartNumber": number + 1, "ETag": f'"{md5.hex()}"'} for number, md5 in enumerate(file.part_md5s)]
        try:
            self._call("complete_multipart_upload", name, UploadId=upload, MultipartUpload={"Parts": parts})
        except (*NOT_THERE, StoreError):
            if not self.holds(name, file):  # else an attempt before succeeded, and its answer was lost
                raise

    def _unfinished(self, name: str, file: LocalFile) -> tuple[str, dict[int, str]]:
        """The upload to go on with, and the MD5 of its parts by their number; a new one where none fits."""
        best: tuple[str, dict[int, str]] = ("", {})
        for upload in self._uploads(name):
            stored = self._parts(name, upload)
            fits = all(0 < number <= len(file.part_md5s) for number in stored)
            if fits and (not best[0] or len(stored) > len(best[1])):
                best, upload = (upload, stored), best[0]
            if upload:
                self._call("abort_multipart_upload", name, UploadId=upload)
        if best[0]:
            return best
        return str(self._call("create_multipart_upload", name)["UploadId"]), {}

    def _uploads(self, name: str) -> list[str]:
        """Unfinished uploads of a key."""
        key = self.store.s3_key(name)
        answer = self.store.call_s3("list_multipart_uploads", name, Prefix=key)
        return [str(one["UploadId"]) for one in answer.get("Uploads", ()) if one["Key"] == key]

    def _parts(self, name: str, upload: str) -> dict[int, str]:
        found: dict[int, str] = {}
        marker = 0
        while True:
            answer = self._call("list_parts", name, UploadId=upload, PartNumberMarker=marker)
            found |= {int(part["PartNumber"]): _etag(part) for part in answer.get("Parts", ())}
            if not answer.get("IsTruncated"):
                return found
            marker = int(answer["NextPartNumberMarker"])

    def _call(self, operation: str, name: str, size_bytes: int = 0, **arguments: object) -> Any:
        return self.store.call_s3(operation, name, size_bytes=size_bytes, Key=self.store.s3_key(name), **arguments)

    def _stated(self, name: str) -> Mapping[str, Any] | None:
        try:
            stated: Mapping[str, Any] = self.store.call("info", name)
        except NOT_THERE:
            return None
        return stated if stated["type"] == "file" else None


def _etag(stated: Mapping[str, Any]) -> str:
    return str(stated.get("ETag", "")).strip('"')
