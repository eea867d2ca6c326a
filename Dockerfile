# Image of dorothie_gym from the checkout: docker build -t dorothie . && docker run --rm dorothie run --no-picture
FROM python:3.11-slim

ENV PIP_NO_CACHE_DIR=1 PYTHONUNBUFFERED=1 SDL_VIDEODRIVER=dummy DOROTHIE_GYM_CACHE=/var/cache/dorothie_gym
ARG EXTRAS=console,video

WORKDIR /opt/dorothie_gym
COPY pyproject.toml constraints.txt README.md LICENSE CHANGELOG.md ./
COPY dorothie_gym ./dorothie_gym
RUN pip install -c constraints.txt ".[${EXTRAS}]"

RUN useradd --create-home player && mkdir -p "$DOROTHIE_GYM_CACHE" && chown player "$DOROTHIE_GYM_CACHE"
USER player
WORKDIR /home/player
RUN dorothie-gym warm-up

EXPOSE 8023
ENTRYPOINT ["dorothie-gym"]
CMD ["run"]
