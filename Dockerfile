# The command `wsm`, without a GPU: docker build -t wsm . && docker run --rm -v "$PWD/runs:/runs" wsm demo --out /runs/demo
FROM python:3.11-slim-bookworm

ENV PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1 PYTHONUNBUFFERED=1

# Versions that are tested; torch, by far the largest package, is a layer of its own.
WORKDIR /opt/wsm
COPY constraints.txt ./
RUN pip install "$(grep '^torch==' constraints.txt)"

COPY pyproject.toml README.md LICENSE ./
COPY wsm_data ./wsm_data
COPY wsm_model ./wsm_model
COPY pipelines ./pipelines
COPY manifests ./manifests
RUN pip install -c constraints.txt '.[hub,s3,view,viz]' \
    && useradd --create-home --uid 1000 wsm \
    && install -d -o wsm /runs

USER 1000
WORKDIR /runs
ENTRYPOINT ["wsm"]
CMD ["--help"]
