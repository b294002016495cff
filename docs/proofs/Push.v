(* A configuration with a slot free in every place is live for everyone, whatever the places hold: move any head, and
   while that leaves a place full, move its head. That ends, with a slot free in every place again. *)
Require Import Model.

Fixpoint words {A} (letters : list A) (k : nat) : list (list A) :=
  match k with 0 => [[]] | S j => [] :: flat_map (fun a => map (cons a) (words letters j)) letters end.

Lemma in_words A (letters : list A) k : forall w, length w <= k -> (forall a, In a w -> In a letters) -> In w (words letters k).
Proof.
  induction k; intros [|a w] L I; simpl in *; auto; try lia.
  right. apply in_flat_map. exists a. split; auto. apply in_map. apply IHk; auto. lia.
Qed.

Lemma distinct_map A B (f : A -> B) l :
  NoDup l -> (forall a b, In a l -> In b l -> f a = f b -> a = b) -> NoDup (map f l).
Proof.
  induction l as [|a l IH]; intros N I; simpl; [constructor|]. inversion N; subst. constructor.
  - intro C. apply in_map_iff in C. destruct C as (b & E & C). apply (I b a) in E; simpl; auto. subst. auto.
  - apply IH; auto. intros x y X Y. apply I; right; auto.
Qed.

Section Push.
Context `{R : roads}.
Variable places : nat.
Variable spots : list spot.
Hypothesis all_spots : forall s, In s spots.
Hypothesis all_places : forall s, place s < places.
Hypothesis loops : forall s t, next s = next t -> s = t.  (* each spot has one before it on its loop *)
Hypothesis some_slot : forall p, 0 < slots p.

Definition roomy (D : config) := forall p, ~ full D p.
Definition push (D E : config) := exists p, full D p /\ move p D E.
Inductive pushes (D : config) : config -> Prop :=
| none : pushes D D
| more E G : pushes D E -> push E G -> pushes D G.

(* only p may be full *)
Definition but (p : nat) (D : config) := forall r, r <> p -> ~ full D r.

Lemma move_leaves_one p D E : possible D -> but p D -> move p D E -> exists q, q <> p /\ but q E.
Proof.
  intros P B (s & line & Dp & Room & Ep & Eq & Rest). exists (place (next s)). split.
  { apply (wants_other D p); auto. exists s. unfold head. rewrite Dp. auto. }
  intros r Nq F. destruct (Nat.eq_dec r p) as [->|Np].
  - unfold full in F. rewrite Ep in F. destruct (P p) as [L _]. rewrite Dp in L. simpl in L. lia.
  - apply (B r Np). unfold full in *. rewrite <- Rest; auto.
Qed.

(* who went last can go back: backwards there is one way *)
Lemma backwards p1 p2 D1 E1 D2 E2 r : possible D1 -> possible D2 -> but p1 D1 -> but p2 D2 ->
  move p1 D1 E1 -> move p2 D2 E2 -> (forall x, E1 x = E2 x) -> full E1 r -> forall x, D1 x = D2 x.
Proof.
  intros P1 P2 B1 B2 (s & l1 & A1 & N1 & Ep1 & Eq1 & Rest1) (t & l2 & A2 & N2 & Ep2 & Eq2 & Rest2) Same F.
  assert (F2 : full E2 r) by (unfold full in *; rewrite <- Same; auto).
  assert (Q1 : r = place (next s)).
  { apply NNPP. intro H. destruct (Nat.eq_dec r p1) as [->|Np].
    - unfold full in F. rewrite Ep1 in F. destruct (P1 p1) as [L _]. rewrite A1 in L. simpl in L. lia.
    - apply (B1 r Np). unfold full in *. rewrite <- Rest1; auto. }
  assert (Q2 : r = place (next t)).
  { apply NNPP. intro H. destruct (Nat.eq_dec r p2) as [->|Np].
    - unfold full in F2. rewrite Ep2 in F2. destruct (P2 p2) as [L _]. rewrite A2 in L. simpl in L. lia.
    - apply (B2 r Np). unfold full in *. rewrite <- Rest2; auto. }
  rewrite <- Q1 in Eq1. rewrite <- Q2 in Eq2. assert (S := Same r). rewrite Eq1, Eq2 in S.
  apply app_inj_tail in S. destruct S as [Sr St]. apply loops in St. subst t.
  assert (p1 = p2).
  { destruct (P1 p1) as [_ I1], (P2 p2) as [_ I2]. rewrite <- (I1 s), <- (I2 s); auto; [rewrite A2|rewrite A1]; left; auto. }
  subst p2. intro x. destruct (Nat.eq_dec x p1) as [->|Np].
  - rewrite A1, A2. f_equal. rewrite <- Ep1, <- Ep2. apply Same.
  - destruct (Nat.eq_dec x r) as [->|Nr]; auto. rewrite <- Rest1, <- Rest2; auto; congruence.
Qed.

Section Run.
Variable X : nat -> config.
Variable k : nat.
Hypothesis begins : possible (X 0) /\ roomy (X 0).
Hypothesis first : exists p, move p (X 0) (X 1).
Hypothesis runs : forall i, 0 < i <= k -> push (X i) (X (S i)).

Lemma steps i : i <= k -> possible (X i) /\ exists p, but p (X i) /\ move p (X i) (X (S i)) /\ (0 < i -> full (X i) p).
Proof.
  induction i; intro L.
  - destruct begins as [P N], first as [p M]. split; auto. exists p. split; [intros r _; auto|split; [auto|lia]].
  - destruct IHi as (P & p & B & M & _); [lia|]. split; [eapply move_possible; eauto|].
    destruct (move_leaves_one p _ _ P B M) as (q & _ & Bq). destruct (runs (S i)) as (r & F & Mr); [lia|].
    exists r. split; [|auto]. assert (r = q); [|subst; auto]. apply NNPP. intro H. apply (Bq r H F).
Qed.

Lemma never_twice i j : 0 < i -> i < j -> j <= k -> ~ forall x, X i x = X j x.
Proof.
  revert j. induction i; intros j I L K Same; [lia|]. destruct j as [|j]; [lia|].
  destruct (steps i) as (P1 & p1 & B1 & M1 & F1); [lia|]. destruct (steps j) as (P2 & p2 & B2 & M2 & F2); [lia|].
  destruct (runs (S i)) as (r & F & _); [lia|].
  assert (Back := backwards p1 p2 _ _ _ _ r P1 P2 B1 B2 M1 M2 Same F).
  destruct i as [|i].
  - destruct begins as [_ N]. apply (N p2). unfold full. rewrite Back. apply F2. lia.
  - apply (IHi j); auto; lia.
Qed.

Definition code (D : config) := map D (seq 0 places).
Definition codes := words (words spots (list_max (map slots (seq 0 places)))) places.

Lemma coded D : possible D -> In (code D) codes.
Proof.
  intro P. apply in_words; unfold code. { rewrite map_length, seq_length. auto. }
  intros l I. apply in_map_iff in I. destruct I as (p & <- & I). apply in_words; auto.
  destruct (P p) as [L _]. eapply Nat.le_trans; [exact L|].
  assert (H : Forall (fun m => m <= list_max (map slots (seq 0 places))) (map slots (seq 0 places))) by (apply list_max_le; auto).
  rewrite Forall_forall in H. apply H. apply in_map. auto.
Qed.

Lemma code_same D E : possible D -> possible E -> code D = code E -> forall p, D p = E p.
Proof.
  intros P Q S p. destruct (le_lt_dec places p) as [L|L].
  - assert (O : forall G, possible G -> G p = []).
    { intros G PG. destruct (G p) as [|s l] eqn:Gp; auto. exfalso. destruct (PG p) as [_ A].
      assert (place s = p) by (apply A; rewrite Gp; left; auto). specialize (all_places s). lia. }
    rewrite O, O; auto.
  - unfold code in S. apply (f_equal (fun l => nth p l [])) in S.
    rewrite 2!(nth_indep _ [] (D (places))) in S by (rewrite map_length, seq_length; auto).
    rewrite map_nth, seq_nth in S by auto. rewrite (nth_indep _ (D places) (E places)) in S by (rewrite map_length, seq_length; auto).
    rewrite map_nth, seq_nth in S by auto. exact S.
Qed.

Lemma not_for_long : k <= length codes.
Proof.
  apply NNPP. intro H. assert (N : NoDup (map (fun i => code (X i)) (seq 1 k))).
  { apply distinct_map; [apply seq_NoDup|]. intros a b A B E. apply in_seq in A. apply in_seq in B.
    assert (Pa : possible (X a)) by (apply steps; lia). assert (Pb : possible (X b)) by (apply steps; lia).
    assert (S := code_same _ _ Pa Pb E). destruct (Nat.lt_trichotomy a b) as [L|[L|L]]; auto; exfalso.
    - apply (never_twice a b); auto; lia.
    - apply (never_twice b a); auto; lia. }
  assert (I : incl (map (fun i => code (X i)) (seq 1 k)) codes).
  { intros c C. apply in_map_iff in C. destruct C as (i & <- & C). apply in_seq in C. apply coded. apply steps. lia. }
  assert (L := NoDup_incl_length N I). rewrite map_length, seq_length in L. lia.
Qed.
End Run.

(* the head of any place can go on, with a slot free everywhere again in the end *)
Theorem roomy_is_live D p : possible D -> roomy D -> D p <> [] ->
  exists E G, move p D E /\ pushes E G /\ possible G /\ roomy G.
Proof.
  intros P N NE. destruct (D p) as [|s line] eqn:Dp; [contradiction|].
  set (q := place (next s)).
  assert (Can : forall (A : config) t l x, A x = t :: l -> possible A -> ~ full A (place (next t)) -> exists B, move x A B).
  { intros A t l x Ax PA F. exists (fun r => if Nat.eq_dec r x then l else if Nat.eq_dec r (place (next t)) then A r ++ [next t] else A r).
    assert (place (next t) <> x).
    { apply (wants_other A x); auto. exists t. unfold head. rewrite Ax. auto. }
    exists t, l. repeat split; auto; intros; repeat destruct Nat.eq_dec; congruence. }
  destruct (Can D s line p Dp P (N _)) as [E M].
  exists E.
  assert (H : forall k, (exists G, pushes E G /\ possible G /\ roomy G) \/
    exists X, X 0 = D /\ X 1 = E /\ pushes E (X (S k)) /\ forall i, 0 < i <= k -> push (X i) (X (S i))).
  { induction k as [|k [H|(X & X0 & X1 & Ps & Rn)]]; auto.
    - right. exists (fun i => match i with 0 => D | _ => E end). repeat split; auto; [constructor|lia].
    - destruct (classic (roomy (X (S k)))) as [Ro|NR].
      + left. exists (X (S k)). split; auto. split; auto.
        destruct (steps X k) with (i := k) as (Pk & y & _ & My & _); auto; try (rewrite X0; auto).
        { exists p. rewrite ?X0, ?X1. auto. }
        eapply move_possible; eauto.
      + right. assert (PS : possible (X (S k)) /\ exists y, but y (X (S k))).
        { destruct (steps X k) with (i := k) as (Pk & y & B & My & _); auto; try (rewrite X0; auto).
          { exists p. rewrite ?X0, ?X1. auto. }
          split; [eapply move_possible; eauto|]. destruct (move_leaves_one y _ _ Pk B My) as (z & _ & Bz). eauto. }
        destruct PS as (PS & y & B). assert (F : full (X (S k)) y).
        { apply NNPP. intro F. apply NR. intros r Fr. destruct (Nat.eq_dec r y); [subst; auto|]. apply (B r); auto. }
        destruct (X (S k) y) as [|t l] eqn:Xy.
        { unfold full in F. rewrite Xy in F. simpl in F. specialize (some_slot y). lia. }
        destruct (Can (X (S k)) t l y Xy PS) as [G MG].
        { apply B. apply (wants_other (X (S k)) y); auto. exists t. unfold head. rewrite Xy. auto. }
        exists (fun i => if le_lt_dec i (S k) then X i else G).
        destruct (le_lt_dec 0 (S k)); [|lia]. destruct (le_lt_dec 1 (S k)); [|lia].
        destruct (le_lt_dec (S (S k)) (S k)); [lia|]. split; auto. split; auto.
        assert (PG : push (X (S k)) G) by (exists y; auto).
        split; [eapply more; eauto|]. intros i I. destruct (le_lt_dec i (S k)); [|lia].
        destruct (le_lt_dec (S i) (S k)); [apply Rn; lia|]. assert (i = S k) by lia. subst i. auto. }
  destruct (H (S (length codes))) as [(G & A & B & C)|(X & X0 & X1 & _ & Rn)]; [exists G; auto|].
  exfalso. assert (L := not_for_long X (S (length codes))). rewrite X0, X1 in L.
  assert (S (length codes) <= length codes); [|lia]. apply L; auto. eauto.
Qed.
End Push.
Print Assumptions roomy_is_live.
