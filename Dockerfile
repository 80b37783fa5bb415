# The command line with everything compiled: docker build -t vtgtsam . && docker run --rm vtgtsam --help
FROM python:3.12-slim

RUN apt-get update && apt-get install -y --no-install-recommends libgomp1 libegl1 libgl1 \
    && rm -rf /var/lib/apt/lists/*
COPY pyproject.toml README.md LICENSE /src/
COPY vtgtsam /src/vtgtsam
RUN pip install --no-cache-dir '/src[all]' && rm -r /src

ENV VTGTSAM_CACHE=/var/cache/vtgtsam
RUN vtgtsam warm-up && chmod -R a+rwX "$VTGTSAM_CACHE"
WORKDIR /data
ENTRYPOINT ["vtgtsam"]
CMD ["--help"]
