"""Trains a language model with TRL's GRPOTrainer on the first stage of the curriculum, and prints the mean reward.

Without `--model`, a tiny random network whose vocabulary has some whole calls of tools stands for a language model: it
needs no download, and shows the path, not the skill. Two steps take about a minute on one idle core.

    python examples/trl_grpo.py --steps 2
    python examples/trl_grpo.py --model MODEL --steps 200 --group 8 --calls 60 --out runs/grpo

Needs the extra `dorothie-gym[trl]`.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import torch
import trl
from datasets import Dataset
from tokenizers import Tokenizer, decoders, models, pre_tokenizers
from transformers import AutoTokenizer, PreTrainedTokenizerFast, Qwen3Config, Qwen3ForCausalLM
from trl import GRPOConfig, GRPOTrainer

from dorothie_gym.agents.trl.environment import DorothieEnvironment, rows

CALLS = [
    f'<tool_call>\n{{"name": "{name}", "arguments": {{"{argument}": "{value}"}}}}\n</tool_call>'
    for name, argument, value in (("wait", "seconds", "10"), ("drive", "value", "Start"), ("say", "value", "Okay."))
]


def tiny_tokenizer() -> PreTrainedTokenizerFast:
    """Returns a tokenizer of bytes, with the calls as tokens of their own."""
    alphabet = sorted(pre_tokenizers.ByteLevel.alphabet())
    backend = Tokenizer(models.BPE(vocab={letter: number for number, letter in enumerate(alphabet)}, merges=[]))
    backend.pre_tokenizer, backend.decoder = pre_tokenizers.ByteLevel(add_prefix_space=False), decoders.ByteLevel()
    tokenizer = PreTrainedTokenizerFast(
        tokenizer_object=backend,
        eos_token="<|im_end|>",
        pad_token="<|endoftext|>",
        extra_special_tokens=["<|im_start|>"],
    )
    tokenizer.add_tokens(CALLS)
    tokenizer.chat_template = (Path(trl.__file__).parent / "chat_templates" / "qwen3.jinja").read_text()
    return tokenizer


def tiny_model(tokenizer: PreTrainedTokenizerFast) -> Qwen3ForCausalLM:
    """Returns a random network of two layers."""
    torch.manual_seed(0)
    return Qwen3ForCausalLM(
        Qwen3Config(
            vocab_size=len(tokenizer), hidden_size=32, intermediate_size=64, num_hidden_layers=2, num_attention_heads=2,
            num_key_value_heads=2, head_dim=16, max_position_embeddings=40_000, eos_token_id=tokenizer.eos_token_id,
            pad_token_id=tokenizer.pad_token_id,
        )
    )  # fmt: skip


def main() -> None:
    """Trains, and prints the mean reward."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--model", help="name or folder of a model whose template knows tools")
    parser.add_argument("--steps", type=int, default=2)
    parser.add_argument("--group", type=int, default=4, help="rollouts of a session, which share its seed")
    parser.add_argument("--calls", type=int, default=12, help="most calls of tools in a rollout")
    parser.add_argument("--out", default="runs/grpo")
    args = parser.parse_args()
    tokenizer = AutoTokenizer.from_pretrained(args.model) if args.model else tiny_tokenizer()
    bias = {token: 60.0 for token in [*CALLS, "<|im_end|>"]}  # the tiny model chooses among the calls and an end
    favoured = [[[tokenizer.convert_tokens_to_ids(token)], value] for token, value in bias.items()]
    config = GRPOConfig(
        output_dir=args.out, max_steps=args.steps, per_device_train_batch_size=args.group, num_generations=args.group,
        max_tool_calling_iterations=args.calls, max_completion_length=16_000, use_cpu=not torch.cuda.is_available(),
        generation_kwargs={} if args.model else {"sequence_bias": favoured},
        report_to=[], logging_steps=1, save_strategy="no", learning_rate=1e-5 if args.model else 1e-3,
    )  # fmt: skip
    data = Dataset.from_list(rows("train", "street"))
    trainer = GRPOTrainer(
        model=args.model or tiny_model(tokenizer), args=config, train_dataset=data,
        processing_class=tokenizer, environment_factory=DorothieEnvironment,
    )  # fmt: skip
    trainer.train()
    rewards = [entry["reward"] for entry in trainer.state.log_history if "reward" in entry]
    print(f"{args.steps} steps: mean reward {sum(rewards) / len(rewards):.3f}")


if __name__ == "__main__":
    main()
